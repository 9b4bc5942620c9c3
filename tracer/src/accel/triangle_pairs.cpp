#include "tracer/src/accel/triangle_pairs.h"

#include <algorithm>
#include <array>
#include <span>

#include "tracer/src/math/affine.h"

namespace tracer {
namespace {

using Corners = std::array<std::uint32_t, 3>;

bool distinct(const Corners& t) { return t[0] != t[1] && t[1] != t[2] && t[2] != t[0]; }

bool share_edge(const Corners& a, const Corners& b) {
  if (!distinct(a) || !distinct(b)) return false;
  const auto among_b = [&](std::uint32_t corner) { return std::ranges::find(b, corner) != b.end(); };
  return std::ranges::count_if(a, among_b) >= 2;
}

Bounds box_of(const TriangleGeometry& geometry, std::uint32_t triangle) {
  Bounds box;
  for (const std::uint32_t vertex : geometry.triangles[triangle]) box.include(geometry.position(vertex));
  return box;
}

double area(const Bounds& box) {
  const Vec3 side = box.high - box.low;
  return side.x * side.y + side.y * side.z + side.z * side.x;
}

/// Expected number of rays that hit the box around both triangles, and that hit their own boxes: rays hit boxes in
/// proportion to their areas (Goldsmith, Salmon 1987, "Automatic creation of object hierarchies for ray tracing", IEEE
/// CG&A 7(5)). The ratio is one half for the halves of a face, and above one for a face and its thin neighbor around a
/// corner: with those as pairs gear wheels took 1.5 times as long.
struct Cost {
  double both, apart;
  [[nodiscard]] bool worth_it() const { return both <= apart; }
  [[nodiscard]] bool less_than(const Cost& other) const { return both * other.apart < other.both * apart; }
};

Cost cost_of(const TriangleGeometry& geometry, const Bounds& first, std::uint32_t other) {
  const Bounds second = box_of(geometry, other);
  Bounds both = first;
  both.include(second);
  return {area(both), area(first) + area(second)};
}

/// Single triangles by vertex.
class TrianglesAround {
 public:
  TrianglesAround(const TriangleGeometry& geometry, const std::vector<TrianglePair>& pairs)
      : end_(geometry.positions.size() + 1, 0) {
    const auto each_corner = [&](const auto& visit) {
      for (const TrianglePair& one : pairs)
        if (!one.pair())
          for (const std::uint32_t vertex : geometry.triangles[one.first]) visit(vertex, one.first);
    };
    each_corner([&](std::uint32_t vertex, std::uint32_t) { ++end_[vertex + 1]; });
    for (std::size_t vertex = 1; vertex < end_.size(); ++vertex) end_[vertex] += end_[vertex - 1];
    triangles_.resize(end_.back());
    // Each begin moves to its end, which is the next one's begin.
    each_corner([&](std::uint32_t vertex, std::uint32_t triangle) { triangles_[end_[vertex]++] = triangle; });
  }
  [[nodiscard]] std::span<const std::uint32_t> of(std::uint32_t vertex) const {
    const std::uint32_t begin = vertex == 0 ? 0 : end_[vertex - 1];
    return {triangles_.data() + begin, triangles_.data() + end_[vertex]};
  }

 private:
  std::vector<std::uint32_t> end_;
  std::vector<std::uint32_t> triangles_;
};

std::vector<TrianglePair> neighbors_in_list(const TriangleGeometry& geometry, const RenderControl& control) {
  const auto& triangles = geometry.triangles;
  const auto count = static_cast<std::uint32_t>(triangles.size());
  std::vector<TrianglePair> pairs;
  pairs.reserve(count / 2 + std::size_t{1});
  for (std::uint32_t i = 0; i < count;) {
    if (cancelled_at(pairs.size(), control)) break;
    const bool pair = i + 1 < count && share_edge(triangles[i], triangles[i + 1]) &&
                      cost_of(geometry, box_of(geometry, i), i + 1).worth_it();
    pairs.push_back({i, pair ? i + 1 : TrianglePair::none});
    i += pair ? 2 : 1;
  }
  return pairs;
}

/// The single triangle across an edge of `triangle` with the least cost, or none. The neighbors across an edge are
/// around both of its ends: the end with fewer triangles is searched, up to a limit, since any number may share a
/// vertex.
std::uint32_t best_neighbor(const TriangleGeometry& geometry, const TrianglesAround& around,
                            const std::vector<bool>& single, std::uint32_t triangle) {
  constexpr std::size_t candidates_max = 32;
  const Corners& corners = geometry.triangles[triangle];
  const Bounds box = box_of(geometry, triangle);
  std::uint32_t best = TrianglePair::none;
  Cost least{1, 1};
  for (int edge = 0; edge < 3; ++edge) {
    const auto one = around.of(corners[edge]), other = around.of(corners[(edge + 1) % 3]);
    const auto fewer = one.size() < other.size() ? one : other;
    for (const std::uint32_t candidate : fewer.first(std::min(fewer.size(), candidates_max))) {
      if (candidate == triangle || !single[candidate] || !share_edge(corners, geometry.triangles[candidate])) continue;
      const Cost cost = cost_of(geometry, box, candidate);
      if (!cost.worth_it() || (best != TrianglePair::none && !cost.less_than(least))) continue;
      best = candidate;
      least = cost;
    }
  }
  return best;
}

/// Pairs single triangles with single neighbors across their edges.
void pair_across_edges(const TriangleGeometry& geometry, std::vector<TrianglePair>& pairs,
                       const RenderControl& control) {
  const TrianglesAround around(geometry, pairs);
  std::vector<bool> single(geometry.triangles.size(), false);
  for (const TrianglePair& one : pairs) single[one.first] = !one.pair();
  std::size_t number = 0;
  for (TrianglePair& one : pairs) {
    if (cancelled_at(number++, control)) return;
    if (!single[one.first]) continue;
    one.second = best_neighbor(geometry, around, single, one.first);
    if (!one.pair()) continue;
    single[one.first] = single[one.second] = false;
  }
  // A triangle that became the second of a pair is neither single nor first.
  std::erase_if(pairs, [&](const TrianglePair& one) { return !one.pair() && !single[one.first]; });
}

}  // namespace

std::vector<TrianglePair> triangle_pairs(const TriangleGeometry& geometry, const RenderControl& control) {
  std::vector<TrianglePair> pairs = neighbors_in_list(geometry, control);
  if (control.cancelled()) return pairs;
  const std::size_t single = 2 * pairs.size() - geometry.triangles.size();
  if (16 * single > geometry.triangles.size()) pair_across_edges(geometry, pairs, control);
  pairs.shrink_to_fit();
  return pairs;
}

}  // namespace tracer
