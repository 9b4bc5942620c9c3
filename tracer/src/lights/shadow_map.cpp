#include "tracer/src/lights/shadow_map.h"

#include <algorithm>
#include <cmath>

namespace tracer {
namespace {

/// Depth of a point and its position in the window, from -1 to 1.
struct Projection {
  double depth = 0, across = 0, above = 0;
  [[nodiscard]] bool inside() const { return std::abs(across) <= 1 && std::abs(above) <= 1; }
};

Projection project(const ShadowFace& face, const Vec3& point) {
  const Vec3 offset = point - face.origin;
  const double depth = dot(offset, face.axes.n);
  const double half = face.parallel ? face.reach : face.reach * depth;
  if (!(half > 0)) return {depth, HUGE_VAL, HUGE_VAL};  // behind the light
  return {depth, dot(offset, face.axes.e0) / half, dot(offset, face.axes.e1) / half};
}

bool lit_on_face(const ShadowFace& face, const Projection& projected, const Vec3& point, const Vec3& normal) {
  const auto texel = [&](double place) {
    return std::min(face.side - 1, static_cast<std::uint32_t>((place + 1) / 2 * face.side));
  };
  const std::uint32_t column = texel(projected.across), row = texel(projected.above);
  const ShadowFace::Ray ray = face.ray(column, row);
  const Vec3 to_point = face.parallel ? face.axes.n : point - face.origin;
  const double rate = dot(ray.step, normal);
  if (!(rate * dot(to_point, normal) > 0)) return true;  // edge-on: it receives no light
  // Surfaces behind the point do not occlude it, even where the slanted plane is far behind it at the texel's center.
  const double nearest = std::min(dot(point - ray.origin, normal) / rate, projected.depth);
  const double width = 2 * face.reach / face.side * (face.parallel ? 1 : projected.depth);
  return face.base + face.depth[std::size_t{row} * face.side + column] >= nearest - width;
}

}  // namespace

bool ShadowMap::lit(const Vec3& point, const Vec3& normal) const {
  for (const ShadowFace& face : faces) {
    const Projection projected = project(face, point);
    if (projected.inside()) return lit_on_face(face, projected, point, normal);
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
