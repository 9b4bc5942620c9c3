#include "tracer/view.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "tracer/encode.h"
#include "tracer/src/compare/cubehelix.h"
#include "tracer/src/compare/scaling.h"
#include "tracer/src/display/srgb.h"
#include "tracer/src/image_io/decode.h"
#include "tracer/src/math/sampling.h"

namespace tracer {
namespace {

using Reason = ViewFailure::Reason;

std::vector<std::string> channels_of(ViewedLayer layer) {
  switch (layer) {
    case ViewedLayer::depth:
      return {"Z"};
    case ViewedLayer::normal:
      return {"normal.X", "normal.Y", "normal.Z"};
    case ViewedLayer::albedo:
      return {"albedo.R", "albedo.G", "albedo.B"};
    case ViewedLayer::color:
    case ViewedLayer::object_id:
    case ViewedLayer::samples:
    case ViewedLayer::error:
      break;
  }
  return {viewed_layer_names[static_cast<std::size_t>(layer)]};
}

Result<ChannelValues, ViewFailure> read_color(std::span<const std::uint8_t> bytes, const TextureImageLimits& limits) {
  const auto kind = image_kind(bytes);
  if (!kind) return ViewFailure{Reason::not_readable, "is no image"};
  auto image = decode_as(*kind, bytes, is_linear(*kind) ? ColorSpace::linear : ColorSpace::srgb, limits);
  if (!image) return ViewFailure{Reason::not_readable, std::move(image.error())};
  return ChannelValues{image->width, image->height, std::move(image->rgb)};
}

Result<ChannelValues, ViewFailure> read_layer(std::span<const std::uint8_t> bytes, ViewedLayer layer,
                                              const TextureImageLimits& limits) {
  if (layer == ViewedLayer::color) return read_color(bytes, limits);
  auto channels = decode_channels(bytes, channels_of(layer), limits);
  if (!channels) return ViewFailure{Reason::not_readable, std::move(channels.error())};
  if (!channels->values.empty()) return *std::move(channels);
  return ViewFailure{Reason::no_layer,
                     std::string("has no layer ") + viewed_layer_names[static_cast<std::size_t>(layer)]};
}

/// The part of the source that is shown, reduced.
class Part {
 public:
  /// Precondition: the crop is within the source.
  Part(const ChannelValues& source, const View& settings) : source_(source) {
    if (settings.crop) crop_ = *settings.crop;
    const std::uint32_t longer = std::max(crop_[2], crop_[3]);
    width = reduced_length(crop_[2], longer, settings.side);
    height = reduced_length(crop_[3], longer, settings.side);
  }

  /// Calls `each` with the value of every source pixel that the pixel covers.
  template <class Each>
  void for_each_covered(std::uint32_t x, std::uint32_t y, std::size_t channel, Each each) const {
    const auto [left, right] = covered_pixels(x, width, crop_[2]);
    const auto [top, bottom] = covered_pixels(y, height, crop_[3]);
    for (std::size_t row = top; row < bottom; ++row)
      for (std::size_t column = left; column < right; ++column)
        each(source_.values[channels_ * ((crop_[1] + row) * source_.width + crop_[0] + column) + channel]);
  }

  /// Mean of the finite values; not-a-number without any.
  [[nodiscard]] double mean(std::uint32_t x, std::uint32_t y, std::size_t channel) const {
    double sum = 0, count = 0;
    for_each_covered(x, y, channel, [&](float value) {
      if (!std::isfinite(value)) return;
      sum += value;
      ++count;
    });
    return count > 0 ? sum / count : std::numeric_limits<double>::quiet_NaN();
  }

  /// The least and the greatest finite value of numbers; 0 and 0 without any.
  [[nodiscard]] std::array<double, 2> extremes() const {
    std::array<double, 2> found{INFINITY, -INFINITY};
    const auto add = [&](float value) {
      if (std::isfinite(value)) found = {std::min<double>(found[0], value), std::max<double>(found[1], value)};
    };
    for (std::uint32_t y = 0; y < height; ++y)
      for (std::uint32_t x = 0; x < width; ++x) for_each_covered(x, y, 0, add);
    return found[0] <= found[1] ? found : std::array<double, 2>{};
  }

  std::uint32_t width = 0, height = 0;

 private:
  const ChannelValues& source_;
  std::array<std::uint32_t, 4> crop_{0, 0, source_.width, source_.height};
  std::size_t channels_ = source_.values.size() / (std::size_t{source_.width} * source_.height);
};

/// Position in the range, 0 for a value that is not a number.
double fraction_of(double value, const std::array<double, 2>& range) {
  if (!(value > range[0])) return 0;
  return value >= range[1] ? 1 : (value - range[0]) / (range[1] - range[0]);
}

/// Codes of an object's color, as fractions: the sequence of splitmix64, which spreads consecutive ids (Steele, Lea and
/// Flood 2014, "Fast splittable pseudorandom number generators", fig. 15).
std::array<double, 3> color_of_object(float id) {
  if (id == 0) return {};
  const std::uint64_t hash = mix((static_cast<std::uint64_t>(id) - 1) * 0x9e3779b97f4a7c15);
  const auto code = [&](unsigned shift) { return 0.25 + 0.75 * static_cast<double>(hash >> shift & 255U) / 255; };
  return {code(0), code(8), code(16)};
}

/// Codes of a pixel, as fractions.
std::array<double, 3> codes_of(const Part& part, const View& settings, const std::array<double, 2>& range,
                               std::uint32_t x, std::uint32_t y) {
  std::array<double, 3> codes{};
  if (settings.layer == ViewedLayer::object_id) {
    bool first = true;
    part.for_each_covered(x, y, 0, [&](float id) {
      if (std::exchange(first, false)) codes = color_of_object(id);
    });
  } else if (is_number(settings.layer)) {
    const double fraction = fraction_of(part.mean(x, y, 0), range);
    codes = settings.heat ? cubehelix(fraction) : std::array<double, 3>{fraction, fraction, fraction};
  } else {
    for (std::size_t c = 0; c < 3; ++c) codes[c] = fraction_of(part.mean(x, y, c), range);
  }
  return codes;
}

Image drawn(const Part& part, const View& settings) {
  std::array<double, 2> range{-1, 1};
  if (settings.range) range = *settings.range;
  if (is_number(settings.layer) && !settings.range) range = part.extremes();
  const double scale = std::exp2(settings.exposure);
  Image image{.width = part.width, .height = part.height, .rgb = {}};
  image.rgb.reserve(std::size_t{3} * part.width * part.height);
  for (std::uint32_t y = 0; y < part.height; ++y)
    for (std::uint32_t x = 0; x < part.width; ++x) {
      if (is_light(settings.layer)) {
        for (std::size_t c = 0; c < 3; ++c)
          image.rgb.push_back(static_cast<float>(std::min(1.0, scale * part.mean(x, y, c))));
      } else {
        for (const double code : codes_of(part, settings, range, x, y))
          image.rgb.push_back(static_cast<float>(linear_from_srgb(code)));
      }
    }
  return image;
}

}  // namespace

Result<std::vector<std::uint8_t>, ViewFailure> view(std::span<const std::uint8_t> bytes, const View& settings,
                                                    const TextureImageLimits& limits) {
  const auto source = read_layer(bytes, settings.layer, limits);
  if (!source) return source.error();
  if (settings.crop) {
    const auto& [x, y, width, height] = *settings.crop;
    const bool within = width > 0 && height > 0 && std::uint64_t{x} + width <= source->width &&
                        std::uint64_t{y} + height <= source->height;
    if (!within) return ViewFailure{Reason::not_readable, "has another size than its job"};
  }
  auto png = encode(drawn(Part(*source, settings), settings), Format::png);
  if (!png) return ViewFailure{Reason::not_readable, std::move(png.error())};
  return std::move(png->bytes);
}

}  // namespace tracer
