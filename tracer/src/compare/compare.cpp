#include "tracer/compare.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "tracer/src/compare/cubehelix.h"
#include "tracer/src/compare/scaling.h"
#include "tracer/src/display/srgb.h"
#include "tracer/src/display/tone_mapping.h"
#include "tracer/src/image_io/decode.h"

namespace tracer {
namespace {

float code_of_light(float linear) {
  if (!(linear > 0)) return 0;  // not-a-number too
  return linear >= 1 ? 65535 : static_cast<float>(65535 * srgb_from_linear(linear));
}

/// The decoder returns code / 65535 as a float: rounding to the nearest integer restores the code.
float code_of_fraction(float fraction) { return static_cast<float>(std::lround(fraction * 65535.0)); }

/// A channel of a pixel, in codes.
double code_at(const DisplayImage& image, std::uint32_t x, std::uint32_t y, std::size_t channel) {
  return image.codes[3 * (static_cast<std::size_t>(y) * image.width + x) + channel];
}

constexpr std::size_t window_side = 11;  // window size
constexpr double sigma = 1.5, dynamic_range = 255;
constexpr double c1 = (0.01 * dynamic_range) * (0.01 * dynamic_range),
                 c2 = (0.03 * dynamic_range) * (0.03 * dynamic_range);

/// One-dimensional Gaussian with sum 1. The window is separable: it is applied to rows first, then to columns.
std::array<double, window_side> gaussian() {
  std::array<double, window_side> weights{};
  double sum = 0;
  for (std::size_t i = 0; i < window_side; ++i) {
    const double distance = static_cast<double>(i) - (window_side - 1) / 2.0;
    weights[i] = std::exp(-distance * distance / (2 * sigma * sigma));
    sum += weights[i];
  }
  for (double& weight : weights) weight /= sum;
  return weights;
}

/// Weighted means over a window.
struct Moments {
  double a = 0, b = 0, aa = 0, bb = 0, ab = 0;

  void add(double weight, const Moments& other) {
    a += weight * other.a;
    b += weight * other.b;
    aa += weight * other.aa;
    bb += weight * other.bb;
    ab += weight * other.ab;
  }
};

double similarity(const Moments& mean) {
  const double variance_a = mean.aa - mean.a * mean.a, variance_b = mean.bb - mean.b * mean.b;
  const double covariance = mean.ab - mean.a * mean.b;
  return (2 * mean.a * mean.b + c1) * (2 * covariance + c2) /
         ((mean.a * mean.a + mean.b * mean.b + c1) * (variance_a + variance_b + c2));
}

double luma(const DisplayImage& image, std::uint32_t x, std::uint32_t y) {
  const double codes =
      0.2126 * code_at(image, x, y, 0) + 0.7152 * code_at(image, x, y, 1) + 0.0722 * code_at(image, x, y, 2);
  return codes / codes_per_level;
}

using Row = std::vector<Moments>;

/// Row y of both images, filtered horizontally: one element per window.
Row filtered_row(const DisplayImage& a, const DisplayImage& b, std::uint32_t y,
                 const std::array<double, window_side>& weights) {
  Row products(a.width);
  for (std::uint32_t x = 0; x < a.width; ++x) {
    const double of_a = luma(a, x, y), of_b = luma(b, x, y);
    products[x] = {of_a, of_b, of_a * of_a, of_b * of_b, of_a * of_b};
  }
  Row filtered(a.width - window_side + 1);
  for (std::size_t x = 0; x < filtered.size(); ++x)
    for (std::size_t i = 0; i < window_side; ++i) filtered[x].add(weights[i], products[x + i]);
  return filtered;
}

/// Comparison::ssim. Allocates memory for a few rows only. Precondition: equal sizes.
std::optional<double> structural_similarity(const DisplayImage& a, const DisplayImage& b) {
  if (a.width < window_side || a.height < window_side) return std::nullopt;
  const auto weights = gaussian();
  std::array<Row, window_side> rows;  // ring buffer, row y at y % window_side
  double sum = 0;
  for (std::uint32_t y = 0; y < a.height; ++y) {
    rows[y % window_side] = filtered_row(a, b, y, weights);
    if (y + 1 < window_side) continue;
    const std::size_t top = y + 1 - window_side;
    double row_sum = 0;
    for (std::size_t x = 0; x < rows[0].size(); ++x) {
      Moments mean;
      for (std::size_t i = 0; i < window_side; ++i) mean.add(weights[i], rows[(top + i) % window_side][x]);
      row_sum += similarity(mean);
    }
    sum += row_sum;
  }
  return sum / (static_cast<double>(a.width - window_side + 1) * static_cast<double>(a.height - window_side + 1));
}

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

  /// Precondition: accepts(pixel.difference).
  void add(const PixelDifference& pixel) {
    kept_.push_back(pixel);
    std::push_heap(kept_.begin(), kept_.end(), is_worse);
    if (kept_.size() <= most_) return;
    std::pop_heap(kept_.begin(), kept_.end(), is_worse);  // the smallest of them
    kept_.pop_back();
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
    if (worst.accepts(greatest / codes_per_level)) worst.add(difference_at(a, b, x, y));
  }
  for (std::size_t channel = 0; channel < 3; ++channel) sums.squares[channel] += row.squares[channel];
  sums.difference += row.difference;
  sums.greatest = std::max(sums.greatest, row.greatest);
  sums.differing += row.differing;
}

std::string times(const DisplayImage& image) {
  return std::to_string(image.width) + " x " + std::to_string(image.height);
}

}  // namespace

DisplayImage to_display(const Image& image, const Output& output) {
  DisplayImage display{image.width, image.height, image.rgb};
  apply_tone(display.codes, output);
  std::transform(display.codes.begin(), display.codes.end(), display.codes.begin(), code_of_light);
  return display;
}

Result<ImageFile, std::string> read_image(std::span<const std::uint8_t> bytes, const TextureImageLimits& limits) {
  const auto kind = image_kind(bytes);
  if (!kind) return "is no " + alternatives(image_format_rows, &ImageFormatRow::name) + " file";
  auto image = decode_as(*kind, bytes, ColorSpace::linear, limits);  // linear: values as they are in the file
  if (!image) return std::move(image.error());
  ImageFile file{{image->width, image->height, std::move(image->rgb)}, *kind};
  std::vector<float>& codes = file.image.codes;
  std::transform(codes.begin(), codes.end(), codes.begin(), is_linear(*kind) ? code_of_light : code_of_fraction);
  return file;
}

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

Image heat_map(const DisplayImage& a, const DisplayImage& b, double white, std::uint32_t side) {
  const std::uint32_t longer = std::max(a.width, a.height);
  Image image{
      .width = reduced_length(a.width, longer, side), .height = reduced_length(a.height, longer, side), .rgb = {}};
  image.rgb.reserve(std::size_t{3} * image.width * image.height);
  for (std::uint32_t y = 0; y < image.height; ++y) {
    const auto [top, bottom] = covered_pixels(y, image.height, a.height);
    for (std::uint32_t x = 0; x < image.width; ++x) {
      const auto [left, right] = covered_pixels(x, image.width, a.width);
      double greatest = 0;
      for (std::uint32_t row = top; row < bottom; ++row)
        for (std::uint32_t column = left; column < right; ++column)
          greatest = std::max(greatest, greatest_difference(a, b, column, row));
      for (const double encoded : cubehelix(std::min(1.0, greatest / (codes_per_level * white))))
        image.rgb.push_back(static_cast<float>(linear_from_srgb(encoded)));
    }
  }
  return image;
}

}  // namespace tracer
