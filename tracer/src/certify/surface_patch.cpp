#include "tracer/src/certify/surface_patch.h"

#include "tracer/src/shapes/shape_registry.h"

namespace tracer {
namespace {

/// Normal of a hit on a quadric.
AffineVec quadric_normal(const Quadric& q, const BundleHit& hit, const AffineVec& position) {
  const Linear render_from_normal = transposed(q.shape_from_render);
  const auto flat = [&](const Vec3& local) { return exactly(normalize(render_from_normal * local)); };
  if (q.kind == kind_of<UnitDisc>) return flat({0, 0, 1});
  if (q.kind == kind_of<UnitCube>) {
    const int face = static_cast<int>(hit.part) - static_cast<int>(QuadricPart::x_0);
    const double side = face % 2 == 0 ? -1 : 1;
    return flat({face / 2 == 0 ? side : 0, face / 2 == 1 ? side : 0, face / 2 == 2 ? side : 0});
  }
  if (hit.part == QuadricPart::cap_0) return flat({0, 0, -1});
  if (hit.part == QuadricPart::cap_1) return flat({0, 0, 1});
  const AffineVec p = q.shape_from_render * (position - q.origin);
  if (q.kind == kind_of<UnitSphere>) return normalized(render_from_normal * p);
  const double slope = q.radius_1 - q.radius_0;
  return normalized(render_from_normal * AffineVec{p.x, p.y, (p.z * slope + q.radius_0) * -slope});
}

/// Interpolated normals, and the offset to the curved surface that smooth_point() finds: at most the heights of the
/// vertices' planes over the hit.
void set_smooth(const TriangleGeometry& mesh, const BundleHit& hit, SurfacePatch& patch) {
  const auto& vertices = mesh.triangles[patch.primitive.primitive];
  const std::array<AffineForm, 3> weight{1 - (hit.u + hit.v), hit.u, hit.v};
  const AffineVec outward = exactly(hit.back ? -patch.face : patch.face);
  AffineVec sum{};
  double offset = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3 normal = mesh.normal(vertices[i]);
    sum = sum + normal * weight[i];
    offset = std::max(offset, dot(patch.position - mesh.position(vertices[i]), normal).magnitude() * length(normal));
  }
  const AffineForm size = squared_length(sum);
  if (size.range().high < 0x1p-40) return;  // the normal of the face
  const Interval side = dot(sum, outward).range();
  patch.convex = false;
  patch.has_normal = size.range().low > 0x1p-40 && (side.low > 0 || side.high < 0);
  if (!patch.has_normal) return;
  const AffineVec unit = sum * inverse(square_root(size));
  patch.normal = (side.low > 0) == !hit.back ? unit : -unit;
  if (!hit.back) patch.shadow_start = widened(patch.position, offset);
}

}  // namespace

SurfacePatch surface_patch(const SceneBounds& bounds, const PrimitiveRef& primitive, const RayBundle& rays,
                           const BundleHit& hit) {
  const CompiledScene& scene = bounds.scene;
  const GeometrySet& geometry = scene.geometry();
  const auto [number, i] = primitive;
  SurfacePatch patch;
  patch.primitive = primitive;
  patch.material = scene.objects.material[geometry.object_of(primitive)];
  patch.has_normal = bounds.materials[patch.material].has_normal;
  const AffineVec along = rays.direction * hit.t;
  // Rounding of the integrator's directions, distances and points, and its origins of shadow rays: less than 2^7
  // operations relative to the terms of o + t d.
  patch.position = widened(rays.origin + along, (magnitude(rays.origin) + magnitude(along)) * 0x1p-45);
  patch.shadow_start = patch.position;
  patch.convex = !hit.back;
  AffineVec outward;
  switch (geometry.kind_of(number)) {
    case GeometryKind::spheres:
      outward = normalized(patch.position - geometry.spheres[number].center(i));
      break;
    case GeometryKind::triangles:
    case GeometryKind::planes: {
      const PlaneOf plane = *plane_of(geometry, primitive);
      patch.face = normalize(plane.normal);
      if (hit.back) patch.face = -patch.face;
      patch.anchor = plane.point;
      patch.convex = true;
      outward = exactly(hit.back ? -patch.face : patch.face);
      break;
    }
    case GeometryKind::quadrics: {
      const Quadric& quadric = geometry.quadric_set(number).quadrics[i];
      patch.convex |= quadric.kind == kind_of<UnitDisc>;
      outward = quadric_normal(quadric, hit, patch.position);
      break;
    }
  }
  patch.normal = hit.back ? -outward : outward;
  if (geometry.kind_of(number) != GeometryKind::triangles || !patch.has_normal) return patch;
  const TriangleGeometry& mesh = geometry.mesh(number);
  if (!mesh.normals.empty() && !has_face_normals(scene.terms[patch.material].shading)) set_smooth(mesh, hit, patch);
  return patch;
}

}  // namespace tracer
