// Names of the image formats, in a library without OpenImageIO.
#include "tracer/encode.h"

namespace tracer {
namespace {

struct Names {
  std::string_view name, extension, media_type;
};

const Names& names(Format format) {
  static constexpr Names all[] = {{"png", "png", "image/png"},          {"png16", "16.png", "image/png"},
                                  {"exr", "exr", "image/x-exr"},        {"jpg", "jpg", "image/jpeg"},
                                  {"hdr", "hdr", "image/vnd.radiance"}, {"webp", "webp", "image/webp"},
                                  {"tiff", "tiff", "image/tiff"}};
  return all[static_cast<std::size_t>(format)];
}

}  // namespace

std::string_view name(Format format) { return names(format).name; }
std::string_view extension(Format format) { return names(format).extension; }
std::string_view media_type(Format format) { return names(format).media_type; }

}  // namespace tracer
