#include "tracer/src/radiosity/smoothing.h"

#include <limits>

#include "tracer/src/radiosity/patches.h"

namespace tracer {
namespace {

/// The pairs twice as far away.
PatchNeighbors doubled(const PatchNeighbors& near) {
  PatchNeighbors far(near.size());
  for (std::size_t patch = 0; patch < near.size(); ++patch)
    for (std::size_t i = 0; i < 8; ++i) {
      const std::uint32_t next = near[patch][i / 2][i % 2];
      far[patch][i / 2][i % 2] = next == PatchGrid::none ? next : near[next][i / 2][i % 2];
    }
  return far;
}

/// Means of each value and its neighbors, with the weights of a tent.
template <class T>
std::vector<T> filtered(const std::vector<T>& values, const PatchNeighbors& neighbors) {
  constexpr std::array<double, 4> weights{0.125, 0.125, 0.0625, 0.0625};
  std::vector<T> means(values.size());
  for (std::size_t patch = 0; patch < values.size(); ++patch) {
    T sum = values[patch] * 0.25;
    for (std::size_t i = 0; i < weights.size(); ++i) {
      const auto [one, other] = neighbors[patch][i];
      const bool both = one != PatchGrid::none && other != PatchGrid::none;
      sum += (both ? values[one] + values[other] : values[patch] * 2.0) * weights[i];
    }
    means[patch] = sum;
  }
  return means;
}

}  // namespace

void smooth(std::array<std::vector<Color>, 2>& solutions, const PatchNeighbors& beside) {
  const std::array<std::vector<Color>, 2> raw = solutions;
  std::array<std::vector<Color>, 2> wider = raw;
  std::vector<double> least(beside.size(), std::numeric_limits<double>::infinity());
  PatchNeighbors neighbors = beside;
  for (int width = 0; width < 5; ++width) {
    std::vector<double> error(beside.size());
    for (std::size_t patch = 0; patch < error.size(); ++patch)
      for (std::size_t half = 0; half < 2; ++half) {
        const Color apart = wider[half][patch] + raw[1 - half][patch] * -1.0;
        error[patch] += apart.r * apart.r + apart.g * apart.g + apart.b * apart.b;
      }
    error = filtered(filtered(error, beside), doubled(beside));
    for (std::size_t patch = 0; patch < error.size(); ++patch) {
      if (!(error[patch] < least[patch])) continue;
      least[patch] = error[patch];
      for (std::size_t half = 0; half < 2; ++half) solutions[half][patch] = wider[half][patch];
    }
    for (std::vector<Color>& values : wider) values = filtered(values, neighbors);
    neighbors = doubled(neighbors);
  }
}

}  // namespace tracer
