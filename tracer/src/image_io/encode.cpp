#include "tracer/encode.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "tracer/src/display/display_transform.h"
#include "tracer/src/display/srgb.h"
#include "tracer/src/display/tone_mapping.h"
#include "tracer/src/image_io/encoding_error.h"
#include "tracer/src/image_io/oiio_loader.h"
#include "tracer/src/image_io/png_file.h"
#include "tracer/src/parallel/parallel_for.h"

namespace tracer {
namespace {

/// Codes of 8 or 16 bits, three or four per pixel.
template <class Code>
struct DisplayCodes {
  int channels = 3;
  std::vector<Code> codes;
  Palette palette{};  ///< empty: all colors
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
  for (std::size_t pixel = 0; pixel < alpha.size(); ++pixel)
    codes.insert(codes.end(), {display.codes[3 * pixel], display.codes[3 * pixel + 1], display.codes[3 * pixel + 2],
                               static_cast<Code>(std::lround(alpha[pixel] * most))});
  display = {4, std::move(codes), {}};
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
    if (colors != 0) result.palette = reduce_colors(result.codes, colors);
  }
  if (with_alpha) add_alpha(result, image.alpha);
  return result;
}

DisplayTransform display_transform(const Image& image, const Output& output) {
  const bool scaled = output.overflow == Output::Overflow::scale && !image.rgb.empty();
  return {output, scaled ? *std::ranges::max_element(image.rgb) : 0};
}

template <class Code>
EncodingError error_of(const DisplayCodes<Code>& display, const Image& image, const Output& output) {
  return encoding_error(image, display_transform(image, output),
                        levels_of(std::span(display.codes), display.channels, image.width));
}

using EncodedFile = Result<EncodedImage, std::string>;

EncodedFile with_error(Encoded&& file, const EncodingError& error) {
  if (!file) return std::move(file.error());
  return EncodedImage{std::move(*file), error};
}

template <class Code>
EncodedFile encode_png(const Image& image, const Output& output, std::uint32_t colors) {
  constexpr int bits = 8 * sizeof(Code);
  const auto display = to_display<Code>(image, output, Alpha::straight, colors);
  const Palette& palette = display.palette;
  Encoded file = palette.colors.empty()
                     ? png_file(image.width, image.height, display.channels, bits, display.codes.data())
                     : png_file(image.width, image.height, 1, bits, palette.indices.data(), palette.colors);
  return with_error(std::move(file), error_of(display, image, output));
}

/// Appends an integer, the lowest byte first.
template <class Integer>
void put(std::vector<std::uint8_t>& bytes, Integer value) {
  for (std::size_t i = 0; i < sizeof value; ++i) bytes.push_back(static_cast<std::uint8_t>(value >> 8 * i));
}

/// Baseline TIFF (Adobe 1992, "TIFF Revision 6.0", part 1), uncompressed, in one strip. That of OpenImageIO 2.4 depends
/// on the time it takes: it writes the directory again after 5 s.
EncodedFile encode_tiff(const Image& image, const Output& output) {
  const auto display = to_display<std::uint16_t>(image, output);
  const auto channels = static_cast<std::uint32_t>(display.channels);
  const std::uint16_t entries = channels == 4 ? 14 : 13;
  constexpr std::uint32_t header = 8;
  const std::uint32_t bits = header + 2 + 12 * entries + 4;  // after the directory: bits of each channel,
  const std::uint32_t resolution = bits + 2 * channels;      // one pixel per unit,
  const std::uint32_t strip = resolution + 8;                // and the pixels
  const auto strip_bytes = static_cast<std::uint32_t>(2 * display.codes.size());
  enum Type : std::uint16_t { type_short = 3, type_long = 4, type_rational = 5 };
  /// `value` is the offset of values that take more than four bytes.
  struct Entry {
    std::uint16_t tag;
    Type type;
    std::uint32_t count, value;
  };
  const Entry directory[] = {
      {256, type_long, 1, image.width},
      {257, type_long, 1, image.height},
      {258, type_short, channels, bits},
      {259, type_short, 1, 1},  // not compressed
      {262, type_short, 1, 2},  // RGB
      {273, type_long, 1, strip},
      {277, type_short, 1, channels},
      {278, type_long, 1, image.height},  // rows in the strip
      {279, type_long, 1, strip_bytes},
      {282, type_rational, 1, resolution},
      {283, type_rational, 1, resolution},
      {284, type_short, 1, 1},  // channels side by side
      {296, type_short, 1, 1},  // no unit of length
      {338, type_short, 1, 2},  // straight alpha
  };
  std::vector<std::uint8_t> file{'I', 'I', 42, 0};
  file.reserve(strip + std::size_t{strip_bytes});
  put(file, header);  // offset of the directory
  put(file, entries);
  for (const Entry& entry : std::span(directory).first(entries)) {
    put(file, entry.tag);
    put(file, static_cast<std::uint16_t>(entry.type));
    put(file, entry.count);
    put(file, entry.value);
  }
  put(file, std::uint32_t{0});  // no further image
  for (std::uint32_t channel = 0; channel < channels; ++channel) put(file, std::uint16_t{16});
  put(file, std::uint32_t{1});
  put(file, std::uint32_t{1});
  for (const std::uint16_t code : display.codes) put(file, code);
  return with_error(std::move(file), error_of(display, image, output));
}

/// `linear`: radiance of the file, three values per pixel.
EncodingError error_of(const std::vector<float>& linear, const Image& image, const Output& output) {
  const DisplayTransform display = display_transform(image, output);
  const auto levels = [&](std::size_t y, LevelRow& row) {
    const std::size_t row_size = 3 * std::size_t{image.width};
    display.show(std::span(linear).subspan(y * row_size, row_size), row);
  };
  return encoding_error(image, display, levels);
}

/// The nearest 16-bit float, ties to even (IEEE 754, binary16), of finite ones.
float rounded_to_half(float value) {
  constexpr float largest = 65504;
  constexpr int bits = 11, exponent_min = -13;
  const float near = std::clamp(value, -largest, largest);
  int exponent = 0;
  std::frexp(near, &exponent);
  const float step = std::ldexp(1.0f, std::max(exponent, exponent_min) - bits);
  return std::nearbyint(near / step) * step;
}

EncodedFile encode_exr(const Image& image, const Output& output, const OpenImageIo& library) {
  if (!output.half) return with_error(library.exr(image, false), {});
  Image rounded = image;
  for (std::vector<float>* values : {&rounded.rgb, &rounded.alpha})
    std::transform(values->begin(), values->end(), values->begin(), rounded_to_half);
  return with_error(library.exr(rounded, true), error_of(rounded.rgb, image, output));
}

EncodedFile encode_hdr(const Image& image, const Output& output, const OpenImageIo& library) {
  std::vector<float> linear = image.rgb;
  Encoded file = library.write_floats(ImageFormat::hdr, image, linear, output.quality);
  return with_error(std::move(file), error_of(linear, image, output));
}

/// 8-bit codes over black, in any other format.
EncodedFile encode_codes(const Image& image, Format format, const Output& output, const OpenImageIo& library) {
  auto display = to_display<std::uint8_t>(image, output, Alpha::over_black);
  Encoded file = library.write_codes(row(format).kind, image, display.codes, output.quality);
  return with_error(std::move(file), error_of(display, image, output));
}

}  // namespace

EncodedFile encode(const Image& image, Format format, const Output& output) {
  // Not every encoder rejects empty images: the JPEG encoder crashes.
  const std::string encoder = std::string(name(format)) + " encoder: ";
  if (image.width == 0 || image.height == 0) return encoder + "the image has no pixels";
  const std::uint32_t side_max = row(format).side_max;
  if (std::max(image.width, image.height) > side_max)  // the JPEG encoder ends the process
    return encoder + "a side has more than " + std::to_string(side_max) + " pixels";
  if (format == Format::png) return encode_png<std::uint8_t>(image, output, output.palette);
  if (format == Format::png16) return encode_png<std::uint16_t>(image, output, 0);
  if (format == Format::tiff) return encode_tiff(image, output);
  const auto library = open_image_io();
  if (!library) return library.error();
  if (format == Format::exr) return encode_exr(image, output, **library);
  if (format == Format::hdr) return encode_hdr(image, output, **library);
  return encode_codes(image, format, output, **library);
}

}  // namespace tracer
