#include "tracer/src/textures/image_map.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace tracer {
namespace {

/// Weights of the texels `first` .. `first + count - 1` in a texel of the next mip level.
struct FilterWeights {
  std::uint32_t first = 0, count = 1;
  std::array<double, 3> weight{1, 0, 0};
};

/// Texel i of m covers [i n/m, (i+1) n/m) of the n texels of the finer level.
FilterWeights filter_weights(std::uint32_t i, std::uint32_t n, std::uint32_t m) {
  if (n == 1) return {};
  if (n == 2 * m) return {2 * i, 2, {0.5, 0.5, 0}};
  const double whole = n;  // n = 2m + 1
  return {2 * i, 3, {(m - i) / whole, m / whole, (i + 1) / whole}};
}

Image half_of(const Image& image) {
  Image half;
  half.width = std::max(1u, image.width / 2);
  half.height = std::max(1u, image.height / 2);
  half.rgb.reserve(3 * static_cast<std::size_t>(half.width) * half.height);
  for (std::uint32_t y = 0; y < half.height; ++y) {
    const FilterWeights rows = filter_weights(y, image.height, half.height);
    for (std::uint32_t x = 0; x < half.width; ++x) {
      const FilterWeights columns = filter_weights(x, image.width, half.width);
      std::array<double, 3> sum{};
      for (std::uint32_t j = 0; j < rows.count; ++j)
        for (std::uint32_t i = 0; i < columns.count; ++i) {
          const float* texel = image.pixel(columns.first + i, rows.first + j);
          const double weight = rows.weight[j] * columns.weight[i];
          for (std::size_t c = 0; c < 3; ++c) sum[c] += weight * texel[c];
        }
      for (const double channel : sum) half.rgb.push_back(static_cast<float>(channel));
    }
  }
  return half;
}

/// Maps texel indices outside of [0, n) according to the wrap mode.
std::uint32_t wrapped_index(Texture::Wrap wrap, double index, std::uint32_t n) {
  const double last = n - 1.0;
  switch (wrap) {
    case Texture::Wrap::repeat:
      index -= std::floor(index / n) * n;
      break;
    case Texture::Wrap::clamp:
      break;
    case Texture::Wrap::mirror:
      index -= std::floor(index / (2.0 * n)) * (2.0 * n);
      if (index > last) index = 2.0 * n - 1 - index;
      break;
  }
  return static_cast<std::uint32_t>(std::clamp(index, 0.0, last));
}

/// Reduces a coordinate to the vicinity of the image, exactly, so that scaling to texels keeps its fraction.
double brought_near(Texture::Wrap wrap, double x) {
  if (wrap == Texture::Wrap::clamp) return std::clamp(x, -1.0, 2.0);
  return wrap == Texture::Wrap::repeat ? x - std::floor(x) : x - 2 * std::floor(x / 2);
}

Color texel(const Image& level, std::uint32_t x, std::uint32_t y) {
  const float* rgb = level.pixel(x, y);
  return {rgb[0], rgb[1], rgb[2]};
}

Color mixed(const Color& a, const Color& b, double t) { return a * (1 - t) + b * t; }

}  // namespace

ImageMap::ImageMap(Image image) {
  levels_.push_back(std::move(image));
  while (levels_.back().width > 1 || levels_.back().height > 1) levels_.push_back(half_of(levels_.back()));
}

Color ImageMap::nearest(const Vec2& uv, const Wraps& wraps) const {
  const Image& level = levels_.front();
  const double x = std::floor(brought_near(wraps.u, uv.x) * level.width);
  const double y = std::floor(brought_near(wraps.v, uv.y) * level.height);
  return texel(level, wrapped_index(wraps.u, x, level.width),
               level.height - 1 - wrapped_index(wraps.v, y, level.height));
}

Color ImageMap::bilinear(const Image& level, const Vec2& uv, const Wraps& wraps) {
  const double x = brought_near(wraps.u, uv.x) * level.width - 0.5;
  const double y = brought_near(wraps.v, uv.y) * level.height - 0.5;
  const double i = std::floor(x), j = std::floor(y);
  const std::uint32_t left = wrapped_index(wraps.u, i, level.width);
  const std::uint32_t right = wrapped_index(wraps.u, i + 1, level.width);
  const std::uint32_t low = level.height - 1 - wrapped_index(wraps.v, j, level.height);
  const std::uint32_t high = level.height - 1 - wrapped_index(wraps.v, j + 1, level.height);
  return mixed(mixed(texel(level, left, low), texel(level, right, low), x - i),
               mixed(texel(level, left, high), texel(level, right, high), x - i), y - j);
}

Color ImageMap::trilinear(const Vec2& uv, const Vec2& width, const Wraps& wraps) const {
  const double texels = std::max(width.x * levels_.front().width, width.y * levels_.front().height);
  if (!(texels > 1)) return bilinear(uv, wraps);
  const double last = static_cast<double>(levels_.size() - 1);
  const double level = std::min(std::log2(texels), last);
  const auto fine = static_cast<std::size_t>(level);
  const Color below = bilinear(levels_[fine], uv, wraps);
  const double t = level - static_cast<double>(fine);
  return t > 0 ? mixed(below, bilinear(levels_[fine + 1], uv, wraps), t) : below;
}

std::uint64_t ImageMap::memory_bytes() const {
  std::uint64_t bytes = 0;
  for (const Image& level : levels_) bytes += level.rgb.capacity() * sizeof(float);
  return bytes;
}

}  // namespace tracer
