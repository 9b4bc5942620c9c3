#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <memory>

#include "tracer/src/image_io/exr_channels.h"
#include "tracer/src/image_io/oiio_plugin.h"

namespace tracer {
namespace {

/// OpenImageIO reports errors as a result, by has_error() only (PNG on a failed write), or as an exception.
Encoded write(const char* format, const OIIO::ImageSpec& spec, const OIIO::TypeDesc& type, const void* pixels) try {
  std::vector<std::uint8_t> bytes;
  OIIO::Filesystem::IOVecOutput memory(bytes);  // outlives the encoder, whose destructor may write
  const std::unique_ptr<OIIO::ImageOutput> output = OIIO::ImageOutput::create(format);
  if (!output) return std::string(format) + " encoder: " + OIIO::geterror();
  const bool written = output->set_ioproxy(&memory) && output->open(format, spec) &&
                       output->write_image(type, pixels) && output->close();
  if (!written || output->has_error()) return std::string(format) + " encoder: " + output->geterror();
  return bytes;
} catch (const std::exception& failure) {
  return std::string(format) + " encoder: " + failure.what();
}

OIIO::ImageSpec spec_of(const Image& image, int channels, const OIIO::TypeDesc& type, const char* color_space) {
  OIIO::ImageSpec spec(static_cast<int>(image.width), static_cast<int>(image.height), channels, type);
  spec.attribute("oiio:ColorSpace", color_space);
  return spec;
}

OIIO::ImageSpec exr_spec(const Image& image, int channels) {
  OIIO::ImageSpec spec = spec_of(image, channels, OIIO::TypeFloat, "Linear");
  // Compared with none, RLE, ZIPS, PIZ and lower levels: none of those that compress rendered floats is clearly faster,
  // and every reader supports ZIP. Level 4 is the library's default.
  spec.attribute("compression", "zip");
  spec.attribute("DateTime", "");  // otherwise the library writes the time of day into the file
  return spec;
}

}  // namespace

Encoded oiio_exr(const Image& image) {
  const ExrChannels channels = exr_channels(image);
  if (channels.names.size() <= 3) return write("openexr", exr_spec(image, 3), OIIO::TypeFloat, image.rgb.data());
  OIIO::ImageSpec spec = exr_spec(image, static_cast<int>(channels.names.size()));
  spec.channelnames = channels.names;
  for (const bool is_integer : channels.is_integer)
    spec.channelformats.push_back(is_integer ? OIIO::TypeUInt32 : OIIO::TypeFloat);
  return write("openexr", spec, OIIO::TypeUnknown, channels.words.data());
}

Encoded oiio_hdr(const Image& image) {
  return write("hdr", spec_of(image, 3, OIIO::TypeFloat, "Linear"), OIIO::TypeFloat, image.rgb.data());
}

Encoded oiio_jpeg(const Image& image, Codes codes) {
  OIIO::ImageSpec spec = spec_of(image, 3, OIIO::TypeUInt8, "sRGB");
  spec.attribute("compression", "jpeg:95");
  spec.attribute("jpeg:subsampling", "4:4:4");  // keeps edges of saturated colors sharp
  return write("jpeg", spec, OIIO::TypeUInt8, codes.data());
}

/// Chroma has half the resolution, even in files that the library calls lossless. No alpha: the library would divide
/// the colors by it again.
Encoded oiio_webp(const Image& image, Codes codes) {
  OIIO::ImageSpec spec = spec_of(image, 3, OIIO::TypeUInt8, "sRGB");
  spec.attribute("compression", "webp:95");
  return write("webp", spec, OIIO::TypeUInt8, codes.data());
}

}  // namespace tracer
