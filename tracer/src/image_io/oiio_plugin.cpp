// The plugin behind oiio_loader.h.
#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <initializer_list>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "tracer/src/display/srgb.h"
#include "tracer/src/image_io/oiio_loader.h"

namespace tracer {
namespace {

// ---- reading -------------------------------------------------------------------------------------------------------

constexpr int rows_at_once = 64;  // JPEG and EXR blocks are 16 to 32 rows high

std::string times(std::uint64_t a, std::uint64_t b) { return std::to_string(a) + " x " + std::to_string(b); }

/// Checks the header against the limits; empty if it is valid.
std::string limit_error(const OIIO::ImageSpec& spec, const TextureImageLimits& limits) {
  if (spec.width <= 0 || spec.height <= 0 || spec.nchannels <= 0 || spec.depth > 1) return "has no pixels";
  const auto width = static_cast<std::uint64_t>(spec.width), height = static_cast<std::uint64_t>(spec.height);
  if (width * height > limits.pixels)
    return "the limit pixels is " + std::to_string(limits.pixels) + ", it has " + times(width, height);
  if (static_cast<std::uint64_t>(spec.nchannels) > limits.channels)
    return "the limit channels is " + std::to_string(limits.channels) + ", it has " + std::to_string(spec.nchannels);
  const std::uint64_t bytes = std::max<std::uint64_t>(width * height * 3 * sizeof(float), spec.image_bytes(true));
  if (bytes > limits.bytes)
    return "the limit bytes is " + std::to_string(limits.bytes) + ", as linear floats its " + times(width, height) +
           " pixels take " + std::to_string(bytes);
  return "";
}

/// Converts 16-bit codes (8-bit codes are exactly representable) to linear values.
std::vector<float> decoding_table(ColorSpace space) {
  std::vector<float> table(65536);
  for (std::size_t code = 0; code < table.size(); ++code) {
    const double encoded = static_cast<double>(code) / 65535;
    table[code] = static_cast<float>(space == ColorSpace::srgb ? linear_from_srgb(encoded) : encoded);
  }
  return table;
}

/// Bounds-checked reader of a file in memory. OpenImageIO 2.4's own memory reader trusts tile offsets in files and
/// reads out of bounds.
class FileInMemory final : public OIIO::Filesystem::IOMemReader {
 public:
  /// The bytes must outlive it and are not modified.
  explicit FileInMemory(std::span<const std::uint8_t> bytes)
      : IOMemReader(const_cast<std::uint8_t*>(bytes.data()), bytes.size()), bytes_(bytes) {}

  /// All other read functions call this one.
  std::size_t pread(void* into, std::size_t size, std::int64_t offset) override {
    const auto first = static_cast<std::uint64_t>(offset);  // negative offsets become too large ones
    if (first >= bytes_.size()) return 0;
    const std::size_t count = std::min<std::size_t>(size, bytes_.size() - first);
    std::copy_n(bytes_.data() + first, count, static_cast<std::uint8_t*>(into));
    return count;
  }

 private:
  std::span<const std::uint8_t> bytes_;
};

/// Reads a file in strips.
class Reading {
 public:
  Reading(OIIO::ImageInput& input, ImageFormat kind, ColorSpace space, ImageTexture::Channel channel)
      : input_(input), spec_(input.spec()), space_(space), coded_(!is_linear(kind)) {
    channels_ = std::min(spec_.nchannels, spec_.nchannels < 3 ? 1 : 3);
    if (channel == ImageTexture::Channel::alpha) {
      space_ = ColorSpace::linear;
      first_ = spec_.alpha_channel;
      channels_ = 1;
    } else if (channel >= ImageTexture::Channel::red && channel <= ImageTexture::Channel::blue) {
      first_ = channels_ == 1 ? 0 : static_cast<int>(channel) - static_cast<int>(ImageTexture::Channel::red);
      channels_ = 1;
    }
    luminance_ = channel == ImageTexture::Channel::luminance;
    if (coded_) table_ = decoding_table(space_);
    image_.width = static_cast<std::uint32_t>(spec_.width);
    image_.height = static_cast<std::uint32_t>(spec_.height);
    // Reserves address space only: pages are allocated as rows are written.
    image_.rgb.reserve(3 * static_cast<std::size_t>(image_.width) * image_.height);
  }

  Decoded run() {
    if (first_ < 0) return std::string("has no alpha channel");
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
      if (!std::isfinite(image_.rgb[i]))
        return "is not finite at pixel (" + std::to_string(i / 3 % image_.width) + ", " +
               std::to_string(i / 3 / image_.width) + ")";
    }
    for (std::size_t i = 0; luminance_ && i < image_.rgb.size(); i += 3) {
      float* const rgb = &image_.rgb[i];
      std::fill_n(rgb, 3, 0.2126F * rgb[0] + 0.7152F * rgb[1] + 0.0722F * rgb[2]);
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
    if (spec_.tile_width == 0)
      return input_.read_scanlines(0, 0, top, bottom, 0, first_, first_ + channels_, type, rows.data());
    return input_.read_tiles(0, 0, spec_.x, spec_.x + spec_.width, top, bottom, spec_.z, spec_.z + 1, first_,
                             first_ + channels_, type, rows.data());
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
  bool coded_, luminance_ = false;
  int first_ = 0, channels_ = 3;
  std::vector<float> table_;
  std::vector<std::uint16_t> codes_;
  std::vector<float> values_;
  Image image_;
};

/// `memory` must outlive it.
Result<std::unique_ptr<OIIO::ImageInput>, std::string> open(ImageFormat kind, FileInMemory& memory) {
  const std::string name = row(kind).codec;
  std::unique_ptr<OIIO::ImageInput> input = OIIO::ImageInput::create(name);
  if (!input || input->format_name() != name) return "there is no reader for " + name + ": " + OIIO::geterror();
  OIIO::ImageSpec found, hints;
  hints.attribute("oiio:UnassociatedAlpha", 1);  // colors as stored, not premultiplied
  if (!input->set_ioproxy(&memory) || !input->open(name, found, hints))
    return "cannot be read as " + name + ": " + input->geterror();
  return input;
}

Decoded read(ImageFormat kind, std::span<const std::uint8_t> bytes, ColorSpace space, const TextureImageLimits& limits,
             ImageTexture::Channel channel) {
  FileInMemory memory(bytes);
  const auto opened = open(kind, memory);
  if (!opened) return opened.error();
  const std::unique_ptr<OIIO::ImageInput>& input = *opened;
  if (std::string error = limit_error(input->spec(), limits); !error.empty()) return error;
  if (kind == ImageFormat::tiff && input->spec().format.is_floating_point())
    return std::string("holds floating-point numbers, and TIFF does not say what light they are; OpenEXR does");
  return Reading(*input, kind, space, channel).run();
}

/// Index of the first of these channels, which are consecutive; none if the file does not have them.
std::optional<int> find_channels(const OIIO::ImageSpec& spec, const std::vector<std::string>& names) {
  const auto found = std::search(spec.channelnames.begin(), spec.channelnames.end(), names.begin(), names.end());
  if (found == spec.channelnames.end()) return std::nullopt;
  return static_cast<int>(found - spec.channelnames.begin());
}

Result<ChannelValues, std::string> read_channels(std::span<const std::uint8_t> bytes,
                                                 const std::vector<std::string>& names,
                                                 const TextureImageLimits& limits) {
  FileInMemory memory(bytes);
  const auto opened = open(ImageFormat::openexr, memory);
  if (!opened) return opened.error();
  OIIO::ImageInput& input = **opened;
  const OIIO::ImageSpec spec = input.spec();
  if (std::string error = limit_error(spec, limits); !error.empty()) return error;
  if (spec.tile_width != 0) return std::string("has tiles");
  const auto begin = find_channels(spec, names);
  if (!begin) return ChannelValues{};
  const int count = static_cast<int>(names.size());
  const bool whole = spec.channelformat(*begin) == OIIO::TypeUInt32;  // as floats they would be fractions of 2^32
  ChannelValues found{static_cast<std::uint32_t>(spec.width), static_cast<std::uint32_t>(spec.height), {}};
  std::vector<std::uint32_t> words;
  for (int y = 0; y < spec.height; y += rows_at_once) {
    const int end = std::min(y + rows_at_once, spec.height);
    words.assign(static_cast<std::size_t>(spec.width) * static_cast<std::size_t>((end - y) * count), 0);
    const OIIO::TypeDesc type = whole ? OIIO::TypeUInt32 : OIIO::TypeFloat;
    const bool read =
        input.read_scanlines(0, 0, spec.y + y, spec.y + end, 0, *begin, *begin + count, type, words.data());
    if (!read || input.has_error()) return "is truncated or broken at row " + std::to_string(y);
    for (const std::uint32_t word : words)
      found.values.push_back(whole ? static_cast<float>(word) : std::bit_cast<float>(word));
  }
  return found;
}

// ---- writing -------------------------------------------------------------------------------------------------------

/// OpenImageIO reports errors as a result, by has_error() only (PNG on a failed write), or as an exception.
Encoded write(const std::string& format, const OIIO::ImageSpec& spec, const OIIO::TypeDesc& type,
              const void* pixels) try {
  std::vector<std::uint8_t> bytes;
  OIIO::Filesystem::IOVecOutput memory(bytes);  // outlives the encoder, whose destructor may write
  const std::unique_ptr<OIIO::ImageOutput> output = OIIO::ImageOutput::create(format);
  if (!output) return format + " encoder: " + OIIO::geterror();
  const bool written = output->set_ioproxy(&memory) && output->open(format, spec) &&
                       output->write_image(type, pixels) && output->close();
  if (!written || output->has_error()) return format + " encoder: " + output->geterror();
  return bytes;
} catch (const std::exception& failure) {
  return format + " encoder: " + failure.what();
}

OIIO::ImageSpec spec_of(const Image& image, int channels, const OIIO::TypeDesc& type, const char* color_space) {
  OIIO::ImageSpec spec(static_cast<int>(image.width), static_cast<int>(image.height), channels, type);
  spec.attribute("oiio:ColorSpace", color_space);
  return spec;
}

/// Channels of an EXR: R, G, B, A if there is alpha, and the layers of `image`.
class ExrChannels {
 public:
  ExrChannels(const Image& image, bool half) {
    const OIIO::TypeDesc color = half ? OIIO::TypeHalf : OIIO::TypeFloat;
    add(image.rgb, {"R", "G", "B"}, color);
    add(image.alpha, {"A"}, color);
    add(image.layers.depth, {"Z"});
    add(image.layers.normal, {"normal.X", "normal.Y", "normal.Z"});
    add(image.layers.albedo, {"albedo.R", "albedo.G", "albedo.B"});
    add(image.layers.object_id, {"object_id"});
    add(image.layers.samples, {"samples"});
    add(image.layers.error, {"error"});
  }

  [[nodiscard]] const std::vector<std::string>& names() const { return names_; }
  [[nodiscard]] const std::vector<OIIO::TypeDesc>& types() const { return types_; }

  /// One value per channel, a float of 16 or 32 bits or an integer, interleaved by pixel.
  [[nodiscard]] std::vector<std::uint8_t> interleaved(std::size_t pixels) const {
    std::size_t pixel_bytes = 0;
    for (const OIIO::TypeDesc& type : types_) pixel_bytes += type.size();
    std::vector<std::uint8_t> bytes(pixels * pixel_bytes);
    std::uint8_t* to = bytes.data();
    for (std::size_t pixel = 0; pixel < pixels; ++pixel) {
      for (const auto& [layer, width, type] : layers_) {
        const std::uint32_t* const from = static_cast<const std::uint32_t*>(layer) + pixel * width;
        const std::size_t size = width * type.size();
        if (type == OIIO::TypeHalf) {
          OIIO::convert_pixel_values(OIIO::TypeFloat, from, type, to, static_cast<int>(width));
        } else {
          std::memcpy(to, from, size);
        }
        to += size;
      }
    }
    return bytes;
  }

 private:
  template <class T>
  void add(const std::vector<T>& layer, std::initializer_list<const char*> names,
           const OIIO::TypeDesc& type = std::is_integral_v<T> ? OIIO::TypeUInt32 : OIIO::TypeFloat) {
    static_assert(sizeof(T) == 4);
    if (layer.empty()) return;
    layers_.push_back({layer.data(), names.size(), type});
    names_.insert(names_.end(), names.begin(), names.end());
    types_.insert(types_.end(), names.size(), type);
  }

  struct Layer {
    const void* words;
    std::size_t width;  ///< words per pixel
    OIIO::TypeDesc type;
  };

  std::vector<std::string> names_;
  std::vector<OIIO::TypeDesc> types_;
  std::vector<Layer> layers_;
};

Encoded write_exr(const Image& image, bool half) {
  const ExrChannels channels(image, half);
  OIIO::ImageSpec spec = spec_of(image, static_cast<int>(channels.names().size()), channels.types()[0], "Linear");
  // Compared with none, RLE, ZIPS, PIZ and lower levels: none of those that compress rendered floats is clearly faster,
  // and every reader supports ZIP. Level 4 is the library's default.
  spec.attribute("compression", "zip");
  spec.attribute("DateTime", "");  // otherwise the library writes the time of day into the file
  if (channels.names().size() == 3) return write("openexr", spec, OIIO::TypeFloat, image.rgb.data());
  spec.channelnames = channels.names();
  spec.channelformats = channels.types();
  const std::vector<std::uint8_t> bytes = channels.interleaved(std::size_t{image.width} * image.height);
  return write("openexr", spec, OIIO::TypeUnknown, bytes.data());
}

/// Empty on success. 2.5 times as fast as read().
template <class Value>
std::string read_back(ImageFormat kind, std::span<const std::uint8_t> file, std::span<Value> into) try {
  FileInMemory memory(file);
  const auto opened = open(kind, memory);
  if (!opened) return opened.error();
  OIIO::ImageInput& input = **opened;
  const OIIO::ImageSpec& spec = input.spec();
  if (spec.nchannels != 3 || spec.image_pixels() * 3 != into.size()) return "has another size";
  const bool read = input.read_image(0, 0, 0, 3, OIIO::BaseTypeFromC<Value>::value, into.data());
  return read && !input.has_error() ? "" : "cannot be read: " + input.geterror();
} catch (const std::exception& failure) {
  return std::string("cannot be read: ") + failure.what();
}

/// Chroma of webp has half the resolution, even in files that the library calls lossless. No alpha: for webp the
/// library would divide the colors by it again.
template <class Value>
Encoded write_values(ImageFormat kind, const Image& image, std::span<Value> values, std::uint32_t quality) {
  const OIIO::TypeDesc type = OIIO::BaseTypeFromC<Value>::value;
  const std::string format = row(kind).codec;
  OIIO::ImageSpec spec = spec_of(image, 3, type, is_linear(kind) ? "Linear" : "sRGB");
  spec.attribute("compression", format + ":" + std::to_string(quality));
  spec.attribute("jpeg:subsampling", "4:4:4");  // keeps edges of saturated colors sharp
  Encoded file = write(format, spec, type, values.data());
  if (!file) return file;
  const std::string error = read_back(kind, *file, values);
  return error.empty() ? std::move(file) : format + " encoder: the file " + error;
}

}  // namespace
}  // namespace tracer

extern "C" __attribute__((visibility("default"))) const tracer::OpenImageIo whittle_open_image_io = {
    .write_codes = tracer::write_values<std::uint8_t>,
    .write_floats = tracer::write_values<float>,
    .exr = tracer::write_exr,
    .read = tracer::read,
    .read_channels = tracer::read_channels,
};
