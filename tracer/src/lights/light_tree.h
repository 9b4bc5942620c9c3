#pragma once
/// Selection of one of many lamps by what it may contribute at a point: a binary tree of bounding boxes, in which each
/// step takes a child in proportion to its power over the squared distance (Conty Estevez, Kulla 2018, "Importance
/// Sampling of Many Lights with Adaptive Tree Splitting", without orientations, since surfaces glow on both sides).

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "tracer/src/math/affine.h"
#include "tracer/src/math/sampling.h"
#include "tracer/src/math/vec.h"

namespace tracer {

/// Probability in proportion to a power beside another; half if it is not between 0 and 1, by rounding or infinities.
double share_of(double power, double other);

class LightTree {
 public:
  struct Lamp {
    Bounds bounds;
    double power = 0;  ///< > 0, in any unit
  };
  LightTree() = default;
  /// Throws std::bad_alloc.
  explicit LightTree(std::span<const Lamp> lamps);

  [[nodiscard]] bool empty() const { return nodes_.empty(); }
  /// Power of all lamps over the squared distance. Precondition: it is not empty.
  [[nodiscard]] double irradiance(const Vec3& from) const { return irradiance(nodes_.front(), from); }

  /// A lamp for `xi` uniform in [0,1), and its probability at the point. Precondition: it is not empty.
  [[nodiscard]] Selected select(const Vec3& from, double xi) const;
  /// Probability with which select() takes the lamp.
  [[nodiscard]] double probability(const Vec3& from, std::size_t lamp) const;

  [[nodiscard]] std::uint64_t memory_bytes() const {
    return nodes_.capacity() * sizeof(Node) + leaf_.capacity() * sizeof(std::uint32_t);
  }

 private:
  struct Node {
    Vec3 center;
    double squared_radius = 0;  ///< around the lamps
    double power = 0;
    std::uint32_t second = 0;  ///< the second child; the first follows the node. 0: a leaf
    std::uint32_t lamp = 0;    ///< leaves have one
    std::uint32_t parent = 0;
  };
  std::uint32_t add(std::span<const Lamp> lamps, std::span<std::uint32_t> numbers, std::uint32_t parent);
  static double irradiance(const Node& node, const Vec3& from);
  /// Probability of the first child.
  [[nodiscard]] double share_of_first(const Node& node, const Vec3& from) const;

  std::vector<Node> nodes_;          ///< the root is the first
  std::vector<std::uint32_t> leaf_;  ///< by lamp
};

}  // namespace tracer
