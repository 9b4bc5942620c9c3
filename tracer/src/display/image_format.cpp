// Names of the image formats, in a library without OpenImageIO.
#include "tracer/encode.h"

namespace tracer {
namespace {

struct Names {
  std::string_view name, extension, media_type;
};

Names names(Format format) {
  switch (format) {
    case Format::png:
      return {"png", "png", "image/png"};
    case Format::png16:
      return {"png16", "16.png", "image/png"};
    case Format::exr:
      return {"exr", "exr", "image/x-exr"};
    case Format::jpg:
      return {"jpg", "jpg", "image/jpeg"};
    case Format::hdr:
      return {"hdr", "hdr", "image/vnd.radiance"};
    case Format::webp:
      return {"webp", "webp", "image/webp"};
    case Format::tiff:
      return {"tiff", "tiff", "image/tiff"};
  }
  return {};
}

}  // namespace

std::string_view name(Format format) { return names(format).name; }
std::string_view extension(Format format) { return names(format).extension; }
std::string_view media_type(Format format) { return names(format).media_type; }

}  // namespace tracer
