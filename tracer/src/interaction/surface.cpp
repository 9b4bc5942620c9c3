#include "tracer/src/interaction/surface.h"

#include "tracer/src/materials/compiled_material.h"
#include "tracer/src/shapes/shape_registry.h"

namespace tracer {
namespace {

ShapeHit shape_at(const SphereGeometry& spheres, const Hit& hit, const Vec3& on_ray) {
  const std::uint32_t i = hit.primitive.primitive;
  const PrimitivePoint at = sphere_point(spheres.center(i), spheres.radius[i], on_ray);
  return {{at.position, at.error}, at.across, at.across, {}, spheres.object[i]};
}

ShapeHit shape_at(const PlaneGeometry& planes, const Hit& hit, const Vec3& on_ray) {
  const std::uint32_t i = hit.primitive.primitive;
  const PrimitivePoint at = plane_point(planes.point[i], planes.normal[i], on_ray);
  return {{at.position, at.error}, at.across, at.across, {}, planes.object[i]};
}

ShapeHit shape_at(const TriangleGeometry& mesh, const Hit& hit, const Vec3& /*on_ray*/) {
  const auto& [a, b, c] = mesh.triangles[hit.primitive.primitive];
  const double weight_a = 1 - hit.u - hit.v;
  const PrimitivePoint at = triangle_point(mesh.position(a), mesh.position(b), mesh.position(c), hit.u, hit.v);
  const Vec3 face = normalize(at.across);
  ShapeHit local{{at.position, at.error}, face, face, {}, mesh.object_of(hit.primitive.primitive)};
  if (!mesh.normals.empty()) {
    const auto vertex = [&mesh](std::uint32_t i, double weight) {
      return SmoothVertex{mesh.position(i), mesh.normal(i), weight};
    };
    const SmoothPoint smooth = smooth_point(vertex(a, weight_a), vertex(b, hit.u), vertex(c, hit.v), at.position, face);
    local.shading_normal = smooth.normal;
    local.shadow_offset = smooth.shadow_offset;
  }
  return local;
}

Vec2 triangle_uv(const TriangleGeometry& mesh, const Hit& hit) {
  if (mesh.uvs.empty()) return {hit.u, hit.v};
  const auto& [a, b, c] = mesh.triangles[hit.primitive.primitive];
  const double weight_a = 1 - hit.u - hit.v;
  return {mesh.uvs[a][0] * weight_a + mesh.uvs[b][0] * hit.u + mesh.uvs[c][0] * hit.v,
          mesh.uvs[a][1] * weight_a + mesh.uvs[b][1] * hit.u + mesh.uvs[c][1] * hit.v};
}

/// `p` in the frame of the axes.
Vec3 along(const Axes& axes, const Vec3& p) { return {dot(p, axes.e0), dot(p, axes.e1), dot(p, axes.n)}; }

ShapeHit shape_at(const QuadricGeometry& set, const Hit& hit, const Vec3& on_ray) {
  const std::uint32_t i = hit.primitive.primitive;
  const QuadricPoint at = quadric_point(set.quadrics[i], static_cast<QuadricPart>(hit.u), on_ray);
  return {at.point, at.normal, at.normal, {}, set.object[i]};
}

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
  const auto back = [&](const Vec3& g) { return (axes.e0 * g.x + axes.e1 * g.y + axes.n * g.z) / radius; };
  const UvGradients local = spherical_gradients(along(axes, normal));
  return {back(local.u), back(local.v)};
}

}  // namespace

ShapeHit shape_hit(const GeometrySet& set, const Hit& hit, const Vec3& on_ray) {
  return set.visit(hit.primitive.geometry, [&](const auto& geometry) { return shape_at(geometry, hit, on_ray); });
}

Vec2 uv_at(const CompiledScene& scene, const Hit& hit, const Surface& surface) {
  const GeometrySet& set = scene.geometry();
  const auto [geometry, primitive] = hit.primitive;
  switch (set.kind_of(geometry)) {
    case GeometryKind::spheres:
      return spherical_uv(along(scene.objects.uv_axes[surface.object], surface.geometric_normal));
    case GeometryKind::triangles:
      return triangle_uv(set.mesh(geometry), hit);
    case GeometryKind::quadrics:
      return quadric_uv(set.quadric_set(geometry).quadrics[primitive], static_cast<QuadricPart>(hit.u),
                        surface.point.position);
    case GeometryKind::planes:
      break;
  }
  const Vec3 p = along(scene.objects.uv_axes[surface.object], surface.point.position - set.planes.point[primitive]);
  return {scene.frame.world_from_render(p.x), scene.frame.world_from_render(p.y)};
}

bool is_textured(const Material& material) {
  bool textured = material.bump || material.normal_map;
  for_each_color_texture(material, [&](TextureId) { textured = true; });
  return textured;
}

double curvature_at(const CompiledScene& scene, const PrimitiveRef& primitive) {
  const GeometrySet& set = scene.geometry();
  const GeometryKind kind = set.kind_of(primitive.geometry);
  if (kind == GeometryKind::spheres) return 1 / set.spheres[primitive.geometry].radius[primitive.primitive];
  if (kind != GeometryKind::quadrics) return 0;
  return curvature(set.quadric_set(primitive.geometry).quadrics[primitive.primitive]);
}

std::optional<Corners> corners_at(const CompiledScene& scene, const Hit& hit) {
  const GeometrySet& set = scene.geometry();
  if (set.kind_of(hit.primitive.geometry) != GeometryKind::triangles) return std::nullopt;
  const TriangleGeometry& mesh = set.mesh(hit.primitive.geometry);
  const auto& vertices = mesh.triangles[hit.primitive.primitive];
  const Vec3 origin = mesh.position(vertices[0]);
  const Vec3 face = normalize(cross(mesh.position(vertices[1]) - origin, mesh.position(vertices[2]) - origin));
  const std::array<double, 3> weights{1 - hit.u - hit.v, hit.u, hit.v};
  Corners corners;
  for (std::size_t i = 0; i < 3; ++i) {
    const Vec3 position = mesh.position(vertices[i]);
    Vec3 normal = mesh.normals.empty() ? face : mesh.normal(vertices[i]);
    if (!(dot(normal, normal) > 0)) normal = face;
    if (dot(normal, face) < 0) normal = -normal;
    corners[i] = {{position, abs(position) * rounding_bound(7)}, normal, weights[i]};
  }
  return corners;
}

std::optional<Corner> centroid_at(const CompiledScene& scene, const Hit& hit) {
  const std::optional<Corners> corners = corners_at(scene, hit);
  if (!corners) return std::nullopt;
  const auto& [a, b, c] = *corners;
  const Vec3 pa = a.point.position, pb = b.point.position, pc = c.point.position;
  const Vec3 largest = (abs(pa) + abs(pb) + abs(pc)) / 3, face = normalize(cross(pb - pa, pc - pa));
  const std::vector<PolygonCenter>& centers = scene.geometry().mesh(hit.primitive.geometry).polygon_centers;
  if (centers.empty()) return Corner{{(pa + pb + pc) / 3, largest * rounding_bound(12)}, face, 1};
  const auto& [point, normal] = centers[hit.primitive.primitive];
  return Corner{point, dot(normal, face) > 0 ? normal : face, 1};
}

Surface surface_at(const CompiledScene& scene, const Hit& hit, const Vec3& origin, const Vec3& direction,
                   Approximations::Shading shading) {
  const ShapeHit local = shape_hit(scene.geometry(), hit, origin + direction * hit.t);
  Surface surface;
  surface.point = local.point;
  surface.geometric_normal = local.geometric_normal;
  surface.back = dot(direction, local.geometric_normal) > 0;
  surface.object = local.object;
  surface.material = scene.objects.material[local.object];
  const bool flat = has_face_normals(shading_of(scene.materials[surface.material].shading, shading));
  const Vec3& outward = flat ? local.geometric_normal : local.shading_normal;
  surface.normal = surface.back ? -outward : outward;
  // At a back-face hit the curved surface is on the other side of the facet: no offset is needed.
  if (!flat && !surface.back) surface.shadow_offset = local.shadow_offset;
  if (scene.needs.textures && is_textured(scene.materials[surface.material])) surface.uv = uv_at(scene, hit, surface);
  return surface;
}

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
