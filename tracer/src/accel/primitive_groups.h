#pragma once
/// Which of a geometry's primitives are one to Embree. The tree is built over such runs; which primitive of a run is
/// met is decided in double as ever, so no answer depends on them.

#include "tracer/src/accel/geometry.h"
#include "tracer/src/accel/triangle_pair_bounds.h"

namespace tracer {

/// Every primitive by itself.
template <class Geometry>
class PrimitiveGroups {
 public:
  PrimitiveGroups(const Geometry& geometry, std::uint32_t /*index*/)
      : count_(static_cast<std::uint32_t>(geometry.object.size())) {}
  [[nodiscard]] std::uint32_t count() const { return count_; }
  template <class Visit>
  static void for_each(std::uint32_t run, const Visit& visit) {
    visit(run);
  }
  [[nodiscard]] static std::uint64_t memory_bytes() { return 0; }

 private:
  std::uint32_t count_;
};

template <>
class PrimitiveGroups<TriangleGeometry> {
 public:
  /// `index`: what rays know the geometry by.
  PrimitiveGroups(const TriangleGeometry& geometry, std::uint32_t index)
      : geometry_(&geometry), index_(index), pairs_(triangle_pairs(geometry)) {
    if (!worth_keeping(pairs_.size(), geometry.triangles.size())) return;
    kept_.reserve(pairs_.size());
    for (std::uint32_t run = 0; run < count(); ++run) kept_.push_back(made(run));
  }
  [[nodiscard]] std::uint32_t count() const { return static_cast<std::uint32_t>(pairs_.size()); }
  template <class Visit>
  void for_each(std::uint32_t run, const Visit& visit) const {
    visit(pairs_[run].first);
    if (pairs_[run].pair()) visit(pairs_[run].second);
  }
  /// Where it is kept; else it is made, in `room`.
  [[nodiscard]] const TrianglePairBounds& in_floats(std::uint32_t run, TrianglePairBounds& room) const {
    return kept_.empty() ? room = made(run) : kept_[run];
  }
  [[nodiscard]] std::uint64_t memory_bytes() const {
    return pairs_.capacity() * sizeof(TrianglePair) + kept_.capacity() * sizeof(TrianglePairBounds);
  }

 private:
  /// Runs in floats take 32 bytes a triangle where all are in pairs, 64 where none is; a tree and its geometry 65
  /// and 85. So large meshes of few pairs make them anew for each packet that Embree asks about.
  static bool worth_keeping(std::size_t runs, std::size_t triangles) {
    constexpr std::size_t small = 1u << 20;
    return triangles <= small || runs <= triangles / 4 * 3;
  }
  [[nodiscard]] TrianglePairBounds made(std::uint32_t run) const {
    return triangle_run(*geometry_, index_, pairs_[run]);
  }

  const TriangleGeometry* geometry_;
  std::uint32_t index_;
  std::vector<TrianglePair> pairs_;
  std::vector<TrianglePairBounds> kept_;  ///< or nothing
};

}  // namespace tracer
