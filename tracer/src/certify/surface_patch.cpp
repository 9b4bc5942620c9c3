#include "tracer/src/certify/surface_patch.h"

#include "tracer/src/certify/box_tree.h"
#include "tracer/src/shapes/shape_registry.h"

namespace tracer {
namespace {

/// Position and normal of a hit on a quadric.
void set_quadric(const Quadric& q, const BundleHit& hit, SurfacePatch& patch) {
  const Linear render_from_normal = transposed(q.shape_from_render);
  const bool cube = q.kind == kind_of<UnitCube>, disc = q.kind == kind_of<UnitDisc>;
  patch.convex = !hit.back || disc;
  const auto set_flat = [&](const Vec3& local, double height) {
    const Vec3 outward = normalize(render_from_normal * local);
    patch.flat = true;
    patch.flat_normal = hit.back ? -outward : outward;
    patch.anchor = q.origin + q.render_from_shape * (local * height);
    patch.face = exactly(patch.flat_normal);
  };
  const auto set_curved = [&](const AffineVec& local) {
    const AffineVec outward = render_from_normal * local;
    patch.face = hit.back ? -outward : outward;
  };
  if (disc) return set_flat({0, 0, 1}, 0);
  if (cube) {
    const int face = static_cast<int>(hit.part) - static_cast<int>(QuadricPart::x_0);
    const double side = face % 2 == 0 ? -1 : 1;
    const Vec3 local{face / 2 == 0 ? side : 0, face / 2 == 1 ? side : 0, face / 2 == 2 ? side : 0};
    return set_flat(local, face % 2 == 0 ? 0 : 1);
  }
  if (hit.part == QuadricPart::cap_0) return set_flat({0, 0, -1}, 0);
  if (hit.part == QuadricPart::cap_1) return set_flat({0, 0, 1}, 1);
  const AffineVec p = q.shape_from_render * (patch.hit - q.origin);
  if (q.kind == kind_of<UnitSphere>) return set_curved(p);
  const double slope = q.radius_1 - q.radius_0;
  set_curved({p.x, p.y, (p.z * slope + q.radius_0) * -slope});
}

/// Interpolated normals, and the offset to the curved surface (smooth_point() with forms).
void set_smooth(const TriangleGeometry& mesh, std::uint32_t triangle, SurfacePatch& patch) {
  const auto& vertices = mesh.triangles[triangle];
  const std::array<AffineForm, 3> weight{1 - (patch.u + patch.v), patch.u, patch.v};
  AffineVec sum{}, offset{};
  const AffineVec outward = patch.back ? -patch.face : patch.face;
  for (std::size_t i = 0; i < 3; ++i) sum = sum + mesh.normal(vertices[i]) * weight[i];
  const AffineForm size = squared_length(sum);
  const Interval side = dot(sum, outward).range(), squared_size = size.range();
  patch.flat = false;
  patch.convex = false;
  if (squared_size.high < 0x1p-40) return;  // the normal of the face
  patch.has_normal = squared_size.low > 0x1p-40 && (side.low > 0 || side.high < 0);
  if (patch.has_normal) {
    const AffineVec unit = sum * inverse(square_root(size));
    patch.normal = (side.low > 0) == !patch.back ? unit : -unit;
  }
  if (patch.back) return;
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3 normal = mesh.normal(vertices[i]);
    const Interval same = dot(outward, normal).range();
    const AffineForm height = dot(patch.hit - mesh.position(vertices[i]), normal);
    // A normal across the face may have either sign: the larger offset counts.
    const AffineForm above = positive_part(-height) * weight[i], below = positive_part(height) * weight[i];
    if (same.low >= 0) {
      offset = offset + normal * above;
    } else if (same.high < 0) {
      offset = offset + -normal * below;
    } else {
      const double reach = std::max(above.magnitude(), below.magnitude());
      offset = widened(offset, abs(normal) * reach);
    }
  }
  if (!patch.has_normal) offset = widened(offset, magnitude(offset));  // it may also be that of the face: none
  patch.offset = magnitude(offset) > magnitude(patch.hit) * 0x1p-44;
  patch.shadow_start = patch.position + offset;
}

void set_triangle(const CompiledScene& scene, const PrimitiveRef& primitive, const BundleHit& hit,
                  Approximations::Shading approximate, SurfacePatch& patch) {
  const TriangleGeometry& mesh = scene.geometry().mesh(primitive.geometry);
  patch.object = mesh.object_of(primitive.primitive);
  patch.material = scene.objects.material[patch.object];
  patch.u = hit.u;
  patch.v = hit.v;
  const PlaneOf plane = *plane_of(scene.geometry(), primitive);
  const Vec3 outward = normalize(plane.normal);
  patch.flat = patch.convex = true;
  patch.flat_normal = hit.back ? -outward : outward;
  patch.anchor = plane.point;
  patch.face = exactly(patch.flat_normal);
  patch.normal = patch.face;
  const Material::Shading shading = scene.terms[patch.material].shading;
  const bool at_vertices = approximate != Approximations::Shading::exact || is_lit_by_triangle(shading);
  if (at_vertices) {
    const Bounds box = bounds_of(scene.geometry(), primitive);
    patch.position = {form_of({box.low.x, box.high.x}), form_of({box.low.y, box.high.y}),
                      form_of({box.low.z, box.high.z})};
  }
  patch.shadow_start = patch.position;
  if (!mesh.normals.empty() && !has_face_normals(shading)) set_smooth(mesh, primitive.primitive, patch);
  if (!at_vertices) return;
  patch.has_normal = patch.flat = patch.convex = false;
  patch.offset = true;
}

}  // namespace

SurfacePatch surface_patch(const CompiledScene& scene, const PrimitiveRef& primitive, const RayBundle& rays,
                           const BundleHit& hit, Approximations::Shading approximate) {
  const GeometrySet& geometry = scene.geometry();
  const auto [number, i] = primitive;
  SurfacePatch patch;
  patch.primitive = primitive;
  patch.back = hit.back;
  patch.part = hit.part;
  const AffineVec along = rays.direction * hit.t;
  // Rounding of the integrator's directions, distances and points, and its origins of shadow rays: less than 2^7
  // operations relative to the terms of o + t d.
  patch.hit = widened(rays.origin + along, (magnitude(rays.origin) + magnitude(along)) * 0x1p-45);
  patch.position = patch.shadow_start = patch.hit;
  const GeometryKind kind = geometry.kind_of(number);
  if (kind == GeometryKind::triangles) {
    set_triangle(scene, primitive, hit, approximate, patch);
    return patch;
  }
  if (kind == GeometryKind::spheres) {
    const SphereGeometry& spheres = geometry.spheres[number];
    patch.object = spheres.object[i];
    patch.convex = !hit.back;
    const AffineVec outward = (patch.hit - Vec3{spheres.x[i], spheres.y[i], spheres.z[i]}) * (1 / spheres.radius[i]);
    patch.face = hit.back ? -outward : outward;
  } else if (kind == GeometryKind::quadrics) {
    const QuadricGeometry& set = geometry.quadric_set(number);
    patch.object = set.object[i];
    set_quadric(set.quadrics[i], hit, patch);
  } else {
    patch.object = geometry.planes.object[i];
    patch.flat = patch.convex = true;
    const Vec3 outward = geometry.planes.normal[i];
    patch.flat_normal = hit.back ? -outward : outward;
    patch.anchor = geometry.planes.point[i];
    patch.face = exactly(patch.flat_normal);
  }
  patch.material = scene.objects.material[patch.object];
  patch.normal = patch.flat ? patch.face : normalized(patch.face);
  return patch;
}

}  // namespace tracer
