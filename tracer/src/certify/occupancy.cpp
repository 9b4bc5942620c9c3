#include "tracer/src/certify/occupancy.h"

#include <bit>

#include "tracer/src/certify/triangle_hit.h"

namespace tracer {

void Occupancy::reset(std::vector<Entry>& entries) const {
  entries.clear();
  for (std::uint32_t k = 0; k < geometry_.planes.point.size(); ++k) entries.push_back(plane_bit | k);
  if (bounds_.tree.empty()) return;
  for (std::uint32_t lane = 0; lane < bounds_.tree.node(0).count; ++lane) entries.push_back(lane);
}

void Occupancy::gather(const std::vector<Entry>& around, const ConvexRegion& region, std::size_t entries_max,
                       std::vector<Entry>& entries) const {
  entries.clear();
  for (const Entry entry : around)
    if (is_plane(entry) || overlaps(node_of(entry), entry % BoxTree::width, region)) entries.push_back(entry);
  for (std::size_t i = 0; i < entries.size();) {
    if (is_primitive(entries[i]) || entries.size() >= entries_max) {
      ++i;
      continue;
    }
    const std::uint32_t child = child_of(entries[i]);
    entries[i] = entries.back();
    entries.pop_back();
    for (unsigned mask = overlaps(bounds_.tree.node(child), region); mask != 0; mask &= mask - 1)
      entries.push_back(child * BoxTree::width + static_cast<std::uint32_t>(std::countr_zero(mask)));
  }
}

std::optional<Occupancy::Cover> Occupancy::find_cover(const Beam& beam, const PrimitiveRef& self,
                                                      std::vector<Entry>& entries) const {
  std::optional<Cover> nearest;
  std::size_t kept = 0;
  const bool dense = entries.size() > dense_entries_min;  // none of many triangles covers the block
  for (const Entry entry : entries) {
    if (is_primitive(entry)) {
      const PrimitiveRef primitive = primitive_of(entry);
      if (primitive == self) continue;
      const bool triangle = geometry_.kind_of(primitive.geometry) == GeometryKind::triangles;
      if (triangle && is_outside(geometry_.mesh(primitive.geometry), primitive.primitive, beam.region)) continue;
      if (triangle && dense) {
        entries[kept++] = entry;
        continue;
      }
      const BundleHit hit = intersect(geometry_, primitive, beam.rays);
      if (hit.kind == BundleHit::Kind::miss) continue;
      if (hit.kind == BundleHit::Kind::cover) {
        const Cover cover = cover_of(beam, entry, primitive, hit);
        if (!nearest || cover.depth < nearest->depth) nearest = cover;
      }
    }
    entries[kept++] = entry;
  }
  entries.resize(kept);
  if (nearest)
    std::erase_if(entries, [&](Entry entry) { return entry == nearest->entry || is_hidden(beam, *nearest, entry); });
  return nearest;
}

Occupancy::Cover Occupancy::cover_of(const Beam& beam, Entry entry, const PrimitiveRef& primitive,
                                     const BundleHit& hit) {
  const AffineVec along = beam.rays.direction * hit.t;
  const double rounding = (magnitude(beam.rays.origin) + magnitude(along)) * 0x1p-45;
  const AffineVec position = widened(beam.rays.origin + along, rounding);
  const AffineForm depth = dot(position, beam.axis);
  return {entry, primitive, hit, position, depth.center, depth.range().high};
}

bool Occupancy::is_hidden(const Beam& beam, const Cover& cover, Entry entry) const {
  if (!is_plane(entry) && beam.forward) {
    const BoxTree::Node& node = node_of(entry);
    const std::size_t lane = entry % BoxTree::width;
    const Vec3& axis = beam.axis;
    const double depth = axis.x * (axis.x > 0 ? node.low[0][lane] : node.high[0][lane]) +
                         axis.y * (axis.y > 0 ? node.low[1][lane] : node.high[1][lane]) +
                         axis.z * (axis.z > 0 ? node.low[2][lane] : node.high[2][lane]);
    if (depth - bounds_.tree.reach() * 0x1p-40 > cover.depth_max) return true;
  }
  return is_primitive(entry) && on_one_side(geometry_, primitive_of(entry), beam.rays.origin, cover.position);
}

}  // namespace tracer
