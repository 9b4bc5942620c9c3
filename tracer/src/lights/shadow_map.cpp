#include "tracer/src/lights/shadow_map.h"

#include <algorithm>
#include <cmath>

namespace tracer {
namespace {

/// Projection of the point: depth and position in the window, from -1 to 1.
struct Seen {
  double depth = 0, across = 0, above = 0;
  [[nodiscard]] bool inside() const { return std::abs(across) <= 1 && std::abs(above) <= 1; }
};

Seen seen_through(const ShadowFace& face, const Vec3& point) {
  const Vec3 offset = point - face.origin;
  const double depth = dot(offset, face.axes.n);
  const double half = face.parallel ? face.reach : face.reach * depth;
  if (!(half > 0)) return {depth, HUGE_VAL, HUGE_VAL};  // behind the light
  return {depth, dot(offset, face.axes.e0) / half, dot(offset, face.axes.e1) / half};
}

bool lit_through(const ShadowFace& face, const Seen& seen, const Vec3& point, const Vec3& normal) {
  const auto texel = [&](double place) {
    return std::min(face.side - 1, static_cast<std::uint32_t>((place + 1) / 2 * face.side));
  };
  const std::uint32_t column = texel(seen.across), row = texel(seen.above);
  const ShadowFace::Ray ray = face.ray(column, row);
  const Vec3 to_point = face.parallel ? face.axes.n : point - face.origin;
  const double rate = dot(ray.step, normal);
  if (!(rate * dot(to_point, normal) > 0)) return true;  // seen along its edge: no light falls on it to speak of
  // What is behind the point is not in its way, however far behind the slanted plane runs through the texel's centre.
  const double nearest = std::min(dot(point - ray.origin, normal) / rate, seen.depth);
  const double width = 2 * face.reach / face.side * (face.parallel ? 1 : seen.depth);
  return face.base + face.depth[std::size_t{row} * face.side + column] >= nearest - width;
}

}  // namespace

bool ShadowMap::lit(const Vec3& point, const Vec3& normal) const {
  for (const ShadowFace& face : faces) {
    const Seen seen = seen_through(face, point);
    if (seen.inside()) return lit_through(face, seen, point, normal);
  }
  return true;
}

bool plane_between(const GeometrySet& geometry, const Vec3& origin, const Vec3& direction, double distance,
                   const PrimitiveRef& from) {
  const PlaneGeometry& planes = geometry.planes;
  for (std::uint32_t k = 0; k < planes.point.size(); ++k) {
    if (planes.transmissive[k] != 0 || from == PrimitiveRef{geometry.plane_geometry(), k}) continue;
    const double t = dot(planes.point[k] - origin, planes.normal[k]) / dot(direction, planes.normal[k]);
    if (t > 0 && t < distance) return true;
  }
  return false;
}

}  // namespace tracer
