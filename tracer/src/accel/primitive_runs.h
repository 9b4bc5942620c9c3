#pragma once
/// Which of a geometry's primitives are one to Embree: runs of neighbours in the list, [begin(run), end(run)). The tree
/// is built over runs; which primitive of a run is met is decided in double as ever, so no answer depends on them.

#include <algorithm>

#include "tracer/src/accel/geometry.h"
#include "tracer/src/accel/triangle_run.h"
#include "tracer/src/scene/trace_frame.h"

namespace tracer {

/// Every primitive by itself.
template <class Geometry>
class PrimitiveRuns {
 public:
  PrimitiveRuns(const Geometry& geometry, std::uint32_t /*index*/)
      : count_(static_cast<std::uint32_t>(geometry.object.size())) {}
  [[nodiscard]] std::uint32_t count() const { return count_; }
  [[nodiscard]] static std::uint32_t begin(std::uint32_t run) { return run; }
  [[nodiscard]] static std::uint32_t end(std::uint32_t run) { return run + 1; }
  [[nodiscard]] static std::uint64_t memory_bytes() { return 0; }

 private:
  std::uint32_t count_;
};

/// Two triangles that follow each other, share an edge and fill a box, as the halves of a polygon and neighbours in a
/// strip do. On terrains of 10^5, 10^6 and 4 10^6 triangles (an AVX-512 core, processor time) pairs built in 0.6, 0.56
/// and 0.4 of the time that single triangles took, traced in 0.93, 0.87 and 0.86, and the tree had 0.6 of the bytes;
/// runs of four built faster still, but small scenes traced slower.
template <>
class PrimitiveRuns<TriangleGeometry> {
 public:
  /// `index`: what rays know the geometry by.
  PrimitiveRuns(const TriangleGeometry& geometry, std::uint32_t index) : geometry_(&geometry), index_(index) {
    const auto& triangles = geometry.triangles;
    const auto count = static_cast<std::uint32_t>(triangles.size());
    first_.reserve(count + std::size_t{1});
    for (std::uint32_t i = 0; i < count;) {
      first_.push_back(i);
      i += i + 1 < count && share_edge(triangles[i], triangles[i + 1]) && share_box(geometry, i) ? 2 : 1;
    }
    first_.push_back(count);
    first_.shrink_to_fit();
    if (!worth_keeping(this->count(), count)) return;
    kept_.reserve(this->count());
    for (std::uint32_t run = 0; run < this->count(); ++run) kept_.push_back(made(run));
  }
  [[nodiscard]] std::uint32_t count() const { return static_cast<std::uint32_t>(first_.size() - 1); }
  [[nodiscard]] std::uint32_t begin(std::uint32_t run) const { return first_[run]; }
  [[nodiscard]] std::uint32_t end(std::uint32_t run) const { return first_[run + 1]; }
  /// Where it is kept; else it is made, in `room`.
  [[nodiscard]] const TriangleRun& in_floats(std::uint32_t run, TriangleRun& room) const {
    return kept_.empty() ? room = made(run) : kept_[run];
  }
  [[nodiscard]] std::uint64_t memory_bytes() const {
    return first_.capacity() * sizeof(std::uint32_t) + kept_.capacity() * sizeof(TriangleRun);
  }

 private:
  /// Runs in floats take 32 bytes a triangle where all are in pairs, 64 where none is; a tree and its geometry 65
  /// and 85. So large meshes of few pairs make them anew for each packet that Embree asks about.
  static bool worth_keeping(std::uint32_t runs, std::uint32_t triangles) {
    constexpr std::uint32_t small = 1u << 20;
    return triangles <= small || runs <= triangles / 4 * 3;
  }
  [[nodiscard]] TriangleRun made(std::uint32_t run) const {
    return triangle_run(*geometry_, index_, begin(run), end(run) - begin(run));
  }
  using Corners = std::array<std::uint32_t, 3>;
  static bool share_edge(const Corners& a, const Corners& b) {
    if (!distinct(a) || !distinct(b)) return false;
    const auto among_b = [&](std::uint32_t corner) { return std::find(b.begin(), b.end(), corner) != b.end(); };
    return std::count_if(a.begin(), a.end(), among_b) >= 2;
  }
  static bool distinct(const Corners& t) { return t[0] != t[1] && t[1] != t[2] && t[2] != t[0]; }
  /// Whether the box around triangle `i` and the next is met no more often than theirs are together: boxes are met as
  /// often as their areas say (Goldsmith, Salmon 1987, "Automatic creation of object hierarchies for ray tracing", IEEE
  /// CG&A 7(5)). The halves of a face pass, a face and its thin neighbour around a corner do not: with those as pairs
  /// gear wheels took 1.5 times as long.
  static bool share_box(const TriangleGeometry& geometry, std::uint32_t i) {
    Bounds first, second;
    for (const std::uint32_t vertex : geometry.triangles[i]) first.include(geometry.position(vertex));
    for (const std::uint32_t vertex : geometry.triangles[i + 1]) second.include(geometry.position(vertex));
    Bounds both = first;
    both.include(second.low);
    both.include(second.high);
    return area(both) <= area(first) + area(second);
  }
  static double area(const Bounds& box) {
    const Vec3 side = box.high - box.low;
    return side.x * side.y + side.y * side.z + side.z * side.x;
  }

  const TriangleGeometry* geometry_;
  std::uint32_t index_;
  std::vector<std::uint32_t> first_;  ///< of each run, and one past the last triangle
  std::vector<TriangleRun> kept_;     ///< or nothing
};

}  // namespace tracer
