#include "tracer/encode.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include "tracer/src/display/palette.h"
#include "tracer/src/display/srgb.h"
#include "tracer/src/display/tone_mapping.h"
#include "tracer/src/image_io/oiio_loader.h"
#include "tracer/src/image_io/png_file.h"
#include "tracer/src/image_io/tiff.h"
#include "tracer/src/parallel/parallel_for.h"

namespace tracer {
namespace {

/// Codes of 8 or 16 bits, three or four per pixel.
template <class Code>
struct DisplayCodes {
  int channels = 3;
  std::vector<Code> codes;
};

template <class Code>
std::vector<Code> codes_of(const std::vector<float>& linear) {
  constexpr std::size_t piece = std::size_t{1} << 17;
  std::vector<Code> codes(linear.size());
  for_each_tile((linear.size() + piece - 1) / piece, 0, [&](std::uint64_t index) {
    const std::size_t first = index * piece, count = std::min(piece, linear.size() - first);
    const auto from = std::span(linear).subspan(first, count);
    const auto into = std::span(codes).subspan(first, count);
    if constexpr (sizeof(Code) == 1) {
      srgb8_from_linear(from, into);
    } else {
      srgb16_from_linear(from, into);
    }
  });
  return codes;
}

/// Alpha is coverage and stays linear.
template <class Code>
void add_alpha(DisplayCodes<Code>& display, const std::vector<float>& alpha) {
  constexpr float most = std::numeric_limits<Code>::max();
  std::vector<Code> codes;
  codes.reserve(4 * alpha.size());
  for (std::size_t pixel = 0; pixel < alpha.size(); ++pixel) {
    codes.insert(codes.end(), {display.codes[3 * pixel], display.codes[3 * pixel + 1], display.codes[3 * pixel + 2],
                               static_cast<Code>(std::lround(alpha[pixel] * most))});
  }
  display = {4, std::move(codes)};
}

enum class Alpha { straight, over_black };

template <class Code>
DisplayCodes<Code> to_display(const Image& image, const Output& output, Alpha alpha = Alpha::straight,
                              std::uint32_t colors = 0) {
  DisplayCodes<Code> result;
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

template <class Code>
Encoded encode_png(const Image& image, const DisplayCodes<Code>& display) {
  return png_file(image.width, image.height, display.channels, sizeof(Code) == 1 ? 8 : 16, display.codes.data());
}

}  // namespace

Encoded encode(const Image& image, Format format, const Output& output) {
  // Not every encoder rejects empty images: the JPEG encoder crashes.
  if (image.width == 0 || image.height == 0) return std::string(name(format)) + " encoder: the image has no pixels";
  if (format == Format::png)
    return encode_png(image, to_display<std::uint8_t>(image, output, Alpha::straight, output.palette));
  if (format == Format::png16) return encode_png(image, to_display<std::uint16_t>(image, output));
  if (format == Format::tiff) {
    auto display = to_display<std::uint16_t>(image, output);
    return tiff16(image.width, image.height, static_cast<std::uint16_t>(display.channels), std::move(display.codes));
  }
  const auto library = open_image_io();
  if (!library) return library.error();
  if (format == Format::exr) return (*library)->exr(image);
  if (format == Format::hdr) return (*library)->hdr(image);
  const auto display = to_display<std::uint8_t>(image, output, Alpha::over_black);
  return format == Format::jpg ? (*library)->jpeg(image, display.codes) : (*library)->webp(image, display.codes);
}

}  // namespace tracer
