#include "tracer/src/image_io/decode.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "tracer/src/film/srgb.h"

namespace tracer {
namespace {

using Decoded = Result<Image, std::string>;

constexpr int rows_at_once = 64;  // JPEG and EXR blocks are 16 to 32 rows high

const char* reader_name(ImageFile file) {
  switch (file) {
    case ImageFile::png:
      return "png";
    case ImageFile::jpeg:
      return "jpeg";
    case ImageFile::openexr:
      return "openexr";
    case ImageFile::hdr:
      return "hdr";
  }
  return "";
}

/// libjpeg fills what is missing with grey and calls it a warning: what does not end as a JPEG does is truncated.
bool ends_as_jpeg(std::span<const std::uint8_t> bytes) {
  while (!bytes.empty() && bytes.back() == 0) bytes = bytes.first(bytes.size() - 1);  // padding
  return bytes.size() >= 4 && bytes[bytes.size() - 2] == 0xff && bytes.back() == 0xd9;
}

/// Whether the chunks follow one another to the last, all within the file. (ISO 15948, sec. 5.3: length, type, content,
/// check.) At the end of its bytes OpenImageIO's reader jumps out of libpng over its own strings, which leak.
bool ends_as_png(std::span<const std::uint8_t> bytes) {
  std::size_t at = 8;
  while (bytes.size() >= at + 12) {
    std::uint64_t length = 0;
    for (std::size_t i = at; i < at + 4; ++i) length = length << 8U | bytes[i];
    if (length > bytes.size() - at - 12) return false;
    if (bytes[at + 4] == 'I' && bytes[at + 5] == 'E' && bytes[at + 6] == 'N' && bytes[at + 7] == 'D') return true;
    at += length + 12;
  }
  return false;
}

std::string times(std::uint64_t a, std::uint64_t b) { return std::to_string(a) + " x " + std::to_string(b); }

/// What the header says, against the limits; empty when all is well.
std::string refusal(const OIIO::ImageSpec& spec, const TextureImageLimits& limits) {
  if (spec.width <= 0 || spec.height <= 0 || spec.nchannels <= 0 || spec.depth > 1) return "has no pixels";
  const auto width = static_cast<std::uint64_t>(spec.width), height = static_cast<std::uint64_t>(spec.height);
  if (width * height > limits.pixels) {
    return "the limit pixels is " + std::to_string(limits.pixels) + ", it has " + times(width, height);
  }
  if (static_cast<std::uint64_t>(spec.nchannels) > limits.channels) {
    return "the limit channels is " + std::to_string(limits.channels) + ", it has " + std::to_string(spec.nchannels);
  }
  const std::uint64_t bytes = std::max<std::uint64_t>(width * height * 3 * sizeof(float), spec.image_bytes(true));
  if (bytes > limits.bytes) {
    return "the limit bytes is " + std::to_string(limits.bytes) + ", as linear floats its " + times(width, height) +
           " pixels take " + std::to_string(bytes);
  }
  return "";
}

/// Codes of 16 bits, which hold those of 8 exactly, to linear light.
std::vector<float> decoding_table(ColorSpace space) {
  std::vector<float> table(65536);
  for (std::size_t code = 0; code < table.size(); ++code) {
    const double encoded = static_cast<double>(code) / 65535;
    table[code] = static_cast<float>(space == ColorSpace::srgb ? linear_from_srgb(encoded) : encoded);
  }
  return table;
}

/// One file being read, strip by strip.
class Reading {
 public:
  Reading(OIIO::ImageInput& input, ImageFile file, ColorSpace space)
      : input_(input), spec_(input.spec()), space_(space), coded_(file == ImageFile::png || file == ImageFile::jpeg) {
    if (coded_) table_ = decoding_table(space);
    channels_ = std::min(spec_.nchannels, spec_.nchannels < 3 ? 1 : 3);
    image_.width = static_cast<std::uint32_t>(spec_.width);
    image_.height = static_cast<std::uint32_t>(spec_.height);
    // Address space, not memory: that is taken as rows arrive.
    image_.rgb.reserve(3 * static_cast<std::size_t>(image_.width) * image_.height);
  }

  Decoded run() {
    const int strip = spec_.tile_height > 0 ? spec_.tile_height : rows_at_once;
    for (int y = 0; y < spec_.height; y += strip) {
      const int end = std::min(y + strip, spec_.height);
      const bool read =
          coded_ ? read_rows(codes_, OIIO::TypeUInt16, y, end) : read_rows(values_, OIIO::TypeFloat, y, end);
      if (!read || input_.has_error()) return "is truncated or broken at row " + std::to_string(y) + ": " + reason();
      if (coded_) {
        append(codes_, [&](std::uint16_t code) { return table_[code]; });
      } else {
        append(values_, [&](float value) { return linear(value); });
      }
    }
    for (std::size_t i = 0; i < image_.rgb.size(); ++i) {
      if (!std::isfinite(image_.rgb[i])) {
        return "is not finite at pixel (" + std::to_string(i / 3 % image_.width) + ", " +
               std::to_string(i / 3 / image_.width) + ")";
      }
    }
    return std::move(image_);
  }

  std::string reason() {
    std::string text = input_.geterror();
    if (text.empty()) text = "the reader gives no reason";
    return text;
  }

 private:
  template <class Value>
  bool read_rows(std::vector<Value>& rows, OIIO::TypeDesc type, int begin, int end) {
    const auto pixels = static_cast<std::size_t>(spec_.width) * static_cast<std::size_t>(end - begin);
    rows.assign(pixels * static_cast<std::size_t>(channels_), Value{});
    const int top = spec_.y + begin, bottom = spec_.y + end;
    if (spec_.tile_width == 0) return input_.read_scanlines(0, 0, top, bottom, 0, 0, channels_, type, rows.data());
    return input_.read_tiles(0, 0, spec_.x, spec_.x + spec_.width, top, bottom, spec_.z, spec_.z + 1, 0, channels_,
                             type, rows.data());
  }

  template <class Value, class Linear>
  void append(const std::vector<Value>& rows, const Linear& linear_of) {
    for (std::size_t i = 0; i < rows.size(); i += static_cast<std::size_t>(channels_))
      for (std::size_t c = 0; c < 3; ++c) image_.rgb.push_back(linear_of(rows[channels_ == 1 ? i : i + c]));
  }

  [[nodiscard]] float linear(float value) const {
    if (value <= 0) return 0;
    return space_ == ColorSpace::srgb ? static_cast<float>(linear_from_srgb(value)) : value;
  }

  OIIO::ImageInput& input_;
  const OIIO::ImageSpec spec_;
  ColorSpace space_;
  bool coded_;
  int channels_ = 3;
  std::vector<float> table_;
  std::vector<std::uint16_t> codes_;
  std::vector<float> values_;
  Image image_;
};

Decoded read(std::span<const std::uint8_t> bytes, ImageFile file, ColorSpace space, const TextureImageLimits& limits) {
  OIIO::Filesystem::IOMemReader memory(const_cast<std::uint8_t*>(bytes.data()), bytes.size());  // it only reads
  const std::string name = reader_name(file);
  const std::unique_ptr<OIIO::ImageInput> input = OIIO::ImageInput::create(name);
  if (!input || input->format_name() != name) return "there is no reader for " + name + ": " + OIIO::geterror();
  OIIO::ImageSpec found, hints;
  hints.attribute("oiio:UnassociatedAlpha", 1);  // colours as they are in the file
  if (!input->set_ioproxy(&memory) || !input->open(name, found, hints)) {
    return "cannot be read as " + name + ": " + input->geterror();
  }
  if (std::string refused = refusal(input->spec(), limits); !refused.empty()) return refused;
  if (file == ImageFile::png && !ends_as_png(bytes))
    return std::string("is truncated: its last chunk is not within the file");
  return Reading(*input, file, space).run();
}

}  // namespace

std::optional<ImageFile> image_file(std::span<const std::uint8_t> bytes) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (text.starts_with("\x89PNG\r\n\x1a\n")) return ImageFile::png;
  if (text.starts_with("\xff\xd8\xff")) return ImageFile::jpeg;
  if (text.starts_with("\x76\x2f\x31\x01")) return ImageFile::openexr;
  if (text.starts_with("#?RADIANCE") || text.starts_with("#?RGBE")) return ImageFile::hdr;
  return std::nullopt;
}

Decoded decode(std::span<const std::uint8_t> bytes, std::optional<ColorSpace> color_space,
               const TextureImageLimits& limits) try {
  if (bytes.empty()) return std::string("is empty");
  const std::optional<ImageFile> file = image_file(bytes);
  if (!file) return std::string("is no PNG, JPEG, OpenEXR or Radiance HDR file: its first bytes are none of theirs");
  if (*file == ImageFile::jpeg && !ends_as_jpeg(bytes))
    return std::string("is truncated: it does not end as a JPEG does");
  const bool screen = *file == ImageFile::png || *file == ImageFile::jpeg;
  return read(bytes, *file, color_space.value_or(screen ? ColorSpace::srgb : ColorSpace::linear), limits);
} catch (const std::bad_alloc&) {
  return std::string("takes more memory than there is");
} catch (const std::exception& failure) {
  return std::string("cannot be read: ") + failure.what();
}

}  // namespace tracer
