#pragma once
/// Primitives and nodes of the scene that the rays of a beam may hit, and the one that hides the rest.

#include <optional>
#include <vector>

#include "tracer/src/certify/scene_bounds.h"

namespace tracer {

class Occupancy {
 public:
  /// A child of a node of the tree: a primitive or a node. Or a plane.
  using Entry = std::uint32_t;

  /// A primitive that all rays hit.
  struct Cover {
    Entry entry;
    PrimitiveRef primitive;
    BundleHit hit;
    AffineVec position;
    double depth = 0, depth_max = 0;  ///< along the beam's axis, from the render space's origin
  };

  /// `bounds` must outlive it.
  explicit Occupancy(const SceneBounds& bounds) : bounds_(bounds), geometry_(bounds.scene.geometry()) {}

  [[nodiscard]] bool is_primitive(Entry entry) const { return is_plane(entry) || node_of(entry).leaf; }
  /// Precondition: is_primitive().
  [[nodiscard]] PrimitiveRef primitive_of(Entry entry) const {
    if (is_plane(entry)) return {geometry_.plane_geometry(), entry & ~plane_bit};
    return bounds_.tree.primitive(child_of(entry));
  }

  /// Sets `entries` to the whole scene.
  void reset(std::vector<Entry>& entries) const;
  /// Sets `entries` to those of `around` that overlap the region. Nodes are opened while there are fewer than
  /// `entries_max`.
  void gather(const std::vector<Entry>& around, const ConvexRegion& region, std::size_t entries_max,
              std::vector<Entry>& entries) const;
  /// Removes the entries that no ray hits, or that are hidden by the nearest primitive that all rays hit. That one is
  /// returned and removed, too. `self`, if any, is not hit.
  std::optional<Cover> find_cover(const Beam& beam, const PrimitiveRef& self, std::vector<Entry>& entries) const;

 private:
  static Cover cover_of(const Beam& beam, Entry entry, const PrimitiveRef& primitive, const BundleHit& hit);
  /// True if every ray hits the cover before it can hit the entry: the box of the entry is beyond all hits, or the
  /// segments to the hits stay on one side of a flat primitive.
  [[nodiscard]] bool is_hidden(const Beam& beam, const Cover& cover, Entry entry) const;

  static constexpr Entry plane_bit = 0x80000000u;
  static constexpr std::size_t dense_entries_min = 16;

  static bool is_plane(Entry entry) { return (entry & plane_bit) != 0; }
  [[nodiscard]] const BoxTree::Node& node_of(Entry entry) const { return bounds_.tree.node(entry / BoxTree::width); }
  [[nodiscard]] std::uint32_t child_of(Entry entry) const { return node_of(entry).child[entry % BoxTree::width]; }

  const SceneBounds& bounds_;
  const GeometrySet& geometry_;
};

}  // namespace tracer
