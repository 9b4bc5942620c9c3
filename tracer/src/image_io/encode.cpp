#include "tracer/encode.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include "tracer/src/film/palette.h"
#include "tracer/src/film/srgb.h"
#include "tracer/src/film/tone.h"
#include "tracer/src/image_io/exr_channels.h"
#include "tracer/src/image_io/tiff.h"

namespace tracer {
namespace {

using Bytes = std::vector<std::uint8_t>;
using Encoded = Result<Bytes, std::string>;

/// Whatever goes wrong on the way is told by the call's result, by has_error() alone (PNG on a failed write), or
/// thrown.
Encoded write(const char* format, const OIIO::ImageSpec& spec, const OIIO::TypeDesc& type, const void* pixels) try {
  Bytes bytes;
  OIIO::Filesystem::IOVecOutput memory(bytes);  // outlives the encoder, whose end may still write
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
  spec.attribute("oiio:UnassociatedAlpha", 1);  // ours is straight where there is one
  return spec;
}

// ---- for display ---------------------------------------------------------------------------------------------------

/// Codes of 8 or 16 bits, three or four a pixel.
template <class Code>
struct Shown {
  int channels = 3;
  std::vector<Code> codes;
};

template <class Code>
std::vector<Code> codes_of(const std::vector<float>& linear) {
  std::vector<Code> codes(linear.size());
  if constexpr (sizeof(Code) == 1) {
    srgb8_from_linear(linear, codes);
  } else {
    for (std::size_t i = 0; i < linear.size(); ++i) codes[i] = srgb16_from_linear(linear[i]);
  }
  return codes;
}

/// Alpha is coverage, not light: no curve.
template <class Code>
void add_alpha(Shown<Code>& shown, const std::vector<float>& alpha) {
  constexpr float most = std::numeric_limits<Code>::max();
  std::vector<Code> codes;
  codes.reserve(4 * alpha.size());
  for (std::size_t pixel = 0; pixel < alpha.size(); ++pixel) {
    codes.insert(codes.end(), {shown.codes[3 * pixel], shown.codes[3 * pixel + 1], shown.codes[3 * pixel + 2],
                               static_cast<Code>(std::lround(alpha[pixel] * most))});
  }
  shown = {4, std::move(codes)};
}

enum class Alpha { straight, over_black };

template <class Code>
Shown<Code> shown(const Image& image, const Output& output, Alpha alpha = Alpha::straight, std::uint32_t colors = 0) {
  Shown<Code> result;
  const bool with_alpha = alpha == Alpha::straight && !image.alpha.empty();
  if (!with_alpha && output.exposure == 0 && output.overflow == Output::Overflow::clamp) {
    result.codes = codes_of<Code>(image.rgb);
  } else {
    std::vector<float> linear = with_alpha ? straight_color(image) : image.rgb;
    apply_tone(linear, output);
    result.codes = codes_of<Code>(linear);
  }
  if constexpr (sizeof(Code) == 1) {
    if (colors != 0) reduce_colors(result.codes, colors);
  }
  if (with_alpha) add_alpha(result, image.alpha);
  return result;
}

Encoded encode_png(const Image& image, const Output& output) {
  const auto picture = shown<std::uint8_t>(image, output, Alpha::straight, output.palette);
  OIIO::ImageSpec spec = spec_of(image, picture.channels, OIIO::TypeUInt8, "sRGB");  // writes the sRGB chunk
  // Measured on traced pictures of 1920x1080: 19-34 ms, where the library's defaults take 62-188; the files are 11-59 %
  // larger for it.
  spec.attribute("png:filter", 0x20);  // libpng's PNG_FILTER_UP, and no search among filters
  spec.attribute("compression", "rle");
  spec.attribute("png:compressionLevel", 1);
  return write("png", spec, OIIO::TypeUInt8, picture.codes.data());
}

Encoded encode_png16(const Image& image, const Output& output) {
  const auto picture = shown<std::uint16_t>(image, output);
  const OIIO::ImageSpec spec = spec_of(image, picture.channels, OIIO::TypeUInt16, "sRGB");
  return write("png", spec, OIIO::TypeUInt16, picture.codes.data());
}

Encoded encode_jpg(const Image& image, const Output& output) {
  const auto picture = shown<std::uint8_t>(image, output, Alpha::over_black);
  OIIO::ImageSpec spec = spec_of(image, 3, OIIO::TypeUInt8, "sRGB");
  spec.attribute("compression", "jpeg:95");
  spec.attribute("jpeg:subsampling", "4:4:4");  // edges of saturated colours stay sharp
  return write("jpeg", spec, OIIO::TypeUInt8, picture.codes.data());
}

/// Always with colours at half the resolution: the library hands them over so, even where it calls the file lossless.
/// No alpha: it would divide the colours by it once more.
Encoded encode_webp(const Image& image, const Output& output) {
  const auto picture = shown<std::uint8_t>(image, output, Alpha::over_black);
  OIIO::ImageSpec spec = spec_of(image, 3, OIIO::TypeUInt8, "sRGB");
  spec.attribute("compression", "webp:95");
  return write("webp", spec, OIIO::TypeUInt8, picture.codes.data());
}

Encoded encode_tiff(const Image& image, const Output& output) {
  return tiff16(image.width, image.height, shown<std::uint16_t>(image, output).codes);
}

// ---- radiance ------------------------------------------------------------------------------------------------------

OIIO::ImageSpec exr_spec(const Image& image, int channels) {
  OIIO::ImageSpec spec(static_cast<int>(image.width), static_cast<int>(image.height), channels, OIIO::TypeFloat);
  spec.attribute("oiio:ColorSpace", "Linear");
  // Measured against none, RLE, ZIPS, PIZ and lower levels: of those that really compress traced floats none is clearly
  // faster, and ZIP is what every reader knows. Level 4 is the library's default.
  spec.attribute("compression", "zip");
  spec.attribute("DateTime", "");  // otherwise the library writes the time of day into the file
  return spec;
}

Encoded encode_exr(const Image& image) {
  const ExrChannels channels = exr_channels(image);
  if (channels.names.size() <= 3) return write("openexr", exr_spec(image, 3), OIIO::TypeFloat, image.rgb.data());
  OIIO::ImageSpec spec = exr_spec(image, static_cast<int>(channels.names.size()));
  spec.channelnames = channels.names;
  for (const bool is_integer : channels.is_integer)
    spec.channelformats.push_back(is_integer ? OIIO::TypeUInt32 : OIIO::TypeFloat);
  return write("openexr", spec, OIIO::TypeUnknown, channels.words.data());
}

Encoded encode_hdr(const Image& image) {
  return write("hdr", spec_of(image, 3, OIIO::TypeFloat, "Linear"), OIIO::TypeFloat, image.rgb.data());
}

}  // namespace

Encoded encode(const Image& image, Format format, const Output& output) {
  // Not every encoder refuses that: the JPEG one does not survive it.
  if (image.width == 0 || image.height == 0) return std::string(name(format)) + " encoder: the picture has no pixels";
  switch (format) {
    case Format::png:
      return encode_png(image, output);
    case Format::png16:
      return encode_png16(image, output);
    case Format::exr:
      return encode_exr(image);
    case Format::jpg:
      return encode_jpg(image, output);
    case Format::hdr:
      return encode_hdr(image);
    case Format::webp:
      return encode_webp(image, output);
    case Format::tiff:
      return encode_tiff(image, output);
  }
  return std::string("unknown picture format");
}

}  // namespace tracer
