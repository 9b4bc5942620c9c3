#include "tracer/src/interaction/uv_gradients.h"

#include "tracer/src/shapes/shape_registry.h"

namespace tracer {
namespace {

/// Gradients of a linear function over the triangle: f_a + u (f_b - f_a) + v (f_c - f_a) for barycentric u and v.
UvGradients triangle_gradients(const TriangleGeometry& mesh, std::uint32_t triangle) {
  const auto& [a, b, c] = mesh.triangles[triangle];
  const Vec3 to_b = mesh.position(b) - mesh.position(a), to_c = mesh.position(c) - mesh.position(a);
  const Vec3 normal = cross(to_b, to_c);
  const double area = dot(normal, normal);
  const Vec3 along_b = cross(to_c, normal) / area, along_c = cross(normal, to_b) / area;
  if (mesh.uvs.empty()) return {along_b, along_c};
  const auto &uv_a = mesh.uvs[a], &uv_b = mesh.uvs[b], &uv_c = mesh.uvs[c];
  const auto gradient = [&](std::size_t i) { return along_b * (uv_b[i] - uv_a[i]) + along_c * (uv_c[i] - uv_a[i]); };
  return {gradient(0), gradient(1)};
}

/// A unit vector perpendicular to unit `n` (Duff, Burgess, Christensen, Hery, Kensler, Liani, Villemin 2017, "Building
/// an Orthonormal Basis, Revisited", JCGT 6(1)).
WHITTLE_INLINE Vec3 perpendicular(const Vec3& n) {
  const double side = n.z < 0 ? -1.0 : 1.0, a = -1 / (side + n.z);
  return {1 + side * (n.x * n.x * a), side * (n.x * n.y * a), -side * n.x};
}

/// The projection of a parallelogram on an axis is the convolution of two boxes, whose variances add. Overflow is
/// harmless: it covers the whole texture.
WHITTLE_INLINE double projected(const Vec3& gradient, const Vec3& along, const Vec3& across, double length,
                                double width) {
  const double a = dot(gradient, along) * length, b = dot(gradient, across) * width;
  return std::sqrt(a * a + b * b);
}

/// The projection of the beam on the surface: one side stays, the other is stretched by 1 / cos
/// (Akenine-Moeller, Crassin, Boksansky, Belcour, Panteleev, Wright 2021, "Improved Shader and Texture Level of Detail
/// Using Ray Cones", JCGT 10(1), sec. 3).
WHITTLE_INLINE Vec2 footprint(const UvGradients& gradients, const Vec3& normal, const Vec3& direction, double width) {
  const double cosine = dot(direction, normal);
  const Vec3 down = direction - normal * cosine;
  const double sine = std::sqrt(dot(down, down));
  const bool straight = !(sine > 1e-8);  // any perpendicular direction will do
  const Vec3 any = perpendicular(normal);
  const Vec3 along = select(straight, any, down / sine);
  const Vec3 across = cross(normal, along);
  const double steep = std::abs(cosine), stretched = width / (steep < 1e-30 ? 1e-30 : steep);
  return {projected(gradients.u, along, across, stretched, width),
          projected(gradients.v, along, across, stretched, width)};
}

UvGradients sphere_gradients(const Axes& axes, const Vec3& normal, double radius) {
  const Vec3 p{dot(normal, axes.e0), dot(normal, axes.e1), dot(normal, axes.n)};
  const auto back = [&](const Vec3& g) { return (axes.e0 * g.x + axes.e1 * g.y + axes.n * g.z) / radius; };
  const UvGradients local = spherical_gradients(p);
  return {back(local.u), back(local.v)};
}

}  // namespace

UvGradients uv_gradients_at(const CompiledScene& scene, const Hit& hit, const Surface& surface) {
  const GeometrySet& set = scene.geometry();
  const auto [geometry, primitive] = hit.primitive;
  switch (set.kind_of(geometry)) {
    case GeometryKind::spheres:
      return sphere_gradients(scene.objects.uv_axes[surface.object], surface.geometric_normal,
                              set.spheres[geometry].radius[primitive]);
    case GeometryKind::triangles:
      return triangle_gradients(set.mesh(geometry), primitive);
    case GeometryKind::quadrics:
      return quadric_gradients(set.quadric_set(geometry).quadrics[primitive], static_cast<QuadricPart>(hit.u),
                               surface.point.position);
    case GeometryKind::planes:
      break;
  }
  const Axes& axes = scene.objects.uv_axes[surface.object];
  const double world = scene.frame.world_from_render(1);
  return {axes.e0 * world, axes.e1 * world};
}

Vec2 uv_footprint(const UvGradients& gradients, const Vec3& normal, const Vec3& direction, double width) {
  return footprint(gradients, normal, direction, width);
}

WHITTLE_WIDE void compute_footprints(const FacePacket& __restrict faces, FootprintPacket& __restrict p) {
  for (int i = 0; i < lanes; ++i) {
    const UvGradients gradients{p.gradient_u[i], p.gradient_v[i]};
    const Vec2 found = footprint(gradients, faces.face[i], p.direction[i], p.width[i]);
    p.u[i] = found.x;
    p.v[i] = found.y;
  }
}

}  // namespace tracer
