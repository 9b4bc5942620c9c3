#include "tracer/compare.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "tracer/src/compare/ssim.h"
#include "tracer/src/display/srgb.h"

namespace tracer {
namespace {

/// Sums over the image, in codes; row by row, so that small differences are not lost in a large sum.
struct Sums {
  std::array<double, 3> squares{};
  double difference = 0;
  double greatest = 0;
  std::size_t differing = 0;
};

bool is_worse(const PixelDifference& one, const PixelDifference& other) {
  if (one.difference != other.difference) return one.difference > other.difference;
  return one.y != other.y ? one.y < other.y : one.x < other.x;
}

/// Collects the `most` worst pixels.
class Worst {
 public:
  explicit Worst(std::size_t most) : most_(most) {}

  void offer(const PixelDifference& pixel) {
    if (most_ == 0 || (kept_.size() == most_ && !is_worse(pixel, kept_.front()))) return;
    if (kept_.size() == most_) {
      std::pop_heap(kept_.begin(), kept_.end(), is_worse);  // the smallest of them is at the front of the heap
      kept_.pop_back();
    }
    kept_.push_back(pixel);
    std::push_heap(kept_.begin(), kept_.end(), is_worse);
  }

  [[nodiscard]] bool accepts(double difference) const {
    return difference > 0 && most_ > 0 && (kept_.size() < most_ || difference >= kept_.front().difference);
  }

  std::vector<PixelDifference> sorted() {
    std::sort_heap(kept_.begin(), kept_.end(), is_worse);
    return std::move(kept_);
  }

 private:
  std::size_t most_;
  std::vector<PixelDifference> kept_;
};

/// Maximum over the three channels.
double greatest_difference(const DisplayImage& a, const DisplayImage& b, std::uint32_t x, std::uint32_t y) {
  double greatest = 0;
  for (std::size_t channel = 0; channel < 3; ++channel)
    greatest = std::max(greatest, std::abs(code_at(a, x, y, channel) - code_at(b, x, y, channel)));
  return greatest;
}

PixelDifference difference_at(const DisplayImage& a, const DisplayImage& b, std::uint32_t x, std::uint32_t y) {
  PixelDifference pixel{.x = x, .y = y, .difference = greatest_difference(a, b, x, y) / codes_per_level};
  for (std::size_t channel = 0; channel < 3; ++channel) {
    pixel.a[channel] = code_at(a, x, y, channel) / codes_per_level;
    pixel.b[channel] = code_at(b, x, y, channel) / codes_per_level;
  }
  return pixel;
}

void add_row(const DisplayImage& a, const DisplayImage& b, std::uint32_t y, Sums& sums, Worst& worst) {
  Sums row;
  for (std::uint32_t x = 0; x < a.width; ++x) {
    for (std::size_t channel = 0; channel < 3; ++channel) {
      const double difference = code_at(b, x, y, channel) - code_at(a, x, y, channel);
      row.squares[channel] += difference * difference;
      row.difference += difference;
    }
    const double greatest = greatest_difference(a, b, x, y);
    row.greatest = std::max(row.greatest, greatest);
    if (greatest > codes_per_level) ++row.differing;
    if (worst.accepts(greatest / codes_per_level)) worst.offer(difference_at(a, b, x, y));
  }
  for (std::size_t channel = 0; channel < 3; ++channel) sums.squares[channel] += row.squares[channel];
  sums.difference += row.difference;
  sums.greatest = std::max(sums.greatest, row.greatest);
  sums.differing += row.differing;
}

std::string times(const DisplayImage& image) {
  return std::to_string(image.width) + " x " + std::to_string(image.height);
}

/// Color scheme of Green 2011, clipped to the sRGB gamut; codes as fractions. `fraction` is in [0,1].
std::array<double, 3> cubehelix(double fraction) {
  constexpr double start = 0.5, rotations = -1.5, hue = 1, whole_turn = 6.283185307179586;
  const double angle = whole_turn * (start / 3 + 1 + rotations * fraction);
  const double amplitude = hue * fraction * (1 - fraction) / 2;
  const double c = amplitude * std::cos(angle), s = amplitude * std::sin(angle);
  const std::array<double, 3> color{fraction - 0.14861 * c + 1.78277 * s, fraction - 0.29227 * c - 0.90649 * s,
                                    fraction + 1.97294 * c};
  return {std::clamp(color[0], 0.0, 1.0), std::clamp(color[1], 0.0, 1.0), std::clamp(color[2], 0.0, 1.0)};
}

}  // namespace

Result<Comparison, std::string> compare(const DisplayImage& a, const DisplayImage& b, std::size_t worst_count) {
  if (a.width != b.width || a.height != b.height)
    return "the sizes differ: " + times(a) + " and " + times(b) + " pixels";
  if (a.codes.empty()) return std::string("the images have no pixels");
  Sums sums;
  Worst worst(worst_count);
  for (std::uint32_t y = 0; y < a.height; ++y) add_row(a, b, y, sums, worst);
  Comparison found{.width = a.width, .height = a.height};
  const double pixels = static_cast<double>(a.width) * a.height;
  double squares = 0;
  for (std::size_t channel = 0; channel < 3; ++channel) {
    found.rmse_channel[channel] = std::sqrt(sums.squares[channel] / pixels) / codes_per_level;
    squares += sums.squares[channel];
  }
  found.rmse = std::sqrt(squares / (3 * pixels)) / codes_per_level;
  found.bias = sums.difference / (3 * pixels) / codes_per_level;
  found.greatest = sums.greatest / codes_per_level;
  found.psnr_db = 20 * std::log10(255 / found.rmse);
  found.ssim = structural_similarity(a, b);
  found.differing = static_cast<double>(sums.differing) / pixels;
  found.worst = worst.sorted();
  return found;
}

double heat_scale(const Comparison& comparison) {
  double levels = 1;
  while (levels < 256 && levels < 8 * comparison.rmse) levels *= 2;
  return levels;
}

Image heat_map(const DisplayImage& a, const DisplayImage& b, double white) {
  Image image{.width = a.width, .height = a.height, .rgb = {}};
  image.rgb.reserve(a.codes.size());
  for (std::uint32_t y = 0; y < a.height; ++y)
    for (std::uint32_t x = 0; x < a.width; ++x)
      for (const double encoded : cubehelix(std::min(1.0, greatest_difference(a, b, x, y) / (codes_per_level * white))))
        image.rgb.push_back(static_cast<float>(linear_from_srgb(encoded)));
  return image;
}

}  // namespace tracer
