#include "tracer/src/compare/ssim.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

namespace tracer {
namespace {

constexpr std::size_t side = 11;  // window size
constexpr double sigma = 1.5, range = 255;
constexpr double c1 = (0.01 * range) * (0.01 * range), c2 = (0.03 * range) * (0.03 * range);

/// One-dimensional Gaussian with sum 1. The window is separable: it is applied to rows first, then to columns.
std::array<double, side> gaussian() {
  std::array<double, side> weights{};
  double sum = 0;
  for (std::size_t i = 0; i < side; ++i) {
    const double distance = static_cast<double>(i) - (side - 1) / 2.0;
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
                 const std::array<double, side>& weights) {
  Row products(a.width);
  for (std::uint32_t x = 0; x < a.width; ++x) {
    const double of_a = luma(a, x, y), of_b = luma(b, x, y);
    products[x] = {of_a, of_b, of_a * of_a, of_b * of_b, of_a * of_b};
  }
  Row filtered(a.width - side + 1);
  for (std::size_t x = 0; x < filtered.size(); ++x)
    for (std::size_t i = 0; i < side; ++i) filtered[x].add(weights[i], products[x + i]);
  return filtered;
}

}  // namespace

std::optional<double> structural_similarity(const DisplayImage& a, const DisplayImage& b) {
  if (a.width < side || a.height < side) return std::nullopt;
  const auto weights = gaussian();
  std::array<Row, side> rows;  // ring buffer, row y at y % side
  double sum = 0;
  for (std::uint32_t y = 0; y < a.height; ++y) {
    rows[y % side] = filtered_row(a, b, y, weights);
    if (y + 1 < side) continue;
    const std::size_t top = y + 1 - side;
    double row_sum = 0;
    for (std::size_t x = 0; x < rows[0].size(); ++x) {
      Moments mean;
      for (std::size_t i = 0; i < side; ++i) mean.add(weights[i], rows[(top + i) % side][x]);
      row_sum += similarity(mean);
    }
    sum += row_sum;
  }
  return sum / (static_cast<double>(a.width - side + 1) * static_cast<double>(a.height - side + 1));
}

}  // namespace tracer
