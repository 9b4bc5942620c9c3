#include <algorithm>
#include <limits>

#include "tracer/mesh_file.h"
#include "tracer/src/compile/compile_steps.h"
#include "tracer/src/scene/instancing.h"
#include "tracer/src/shapes/shape_registry.h"

namespace tracer {
namespace {

/// True if a sphere stays a sphere with the same axes: equal scaling, no rotation. (A rotated one is treated
/// as an ellipsoid of equal axes, with the same image.)
bool keeps_spheres(const Linear& m) {
  return m.x.y == 0 && m.x.z == 0 && m.y.x == 0 && m.y.z == 0 && m.z.x == 0 && m.z.y == 0 && m.x.x > 0 &&
         m.x.x == m.y.y && m.x.x == m.z.z;
}

/// The point of the polygon of triangles [first, end) that is nearest its centroid along its mean normal: of a polygon
/// that is not planar or not convex, the centroid itself may be within the solid.
PolygonCenter polygon_center(const TriangleGeometry& mesh, std::size_t first, std::size_t end) {
  Vec3 normal, centroid;
  double area = 0;
  const auto for_each_triangle = [&](const auto& visit) {
    for (std::size_t t = first; t < end; ++t) {
      const auto& [a, b, c] = mesh.triangles[t];
      visit(mesh.position(a), mesh.position(b), mesh.position(c));
    }
  };
  for_each_triangle([&](const Vec3& a, const Vec3& b, const Vec3& c) {
    const Vec3 across = cross(b - a, c - a);
    normal += across;
    area += length(across);
    centroid += (a + b + c) * (length(across) / 3);
  });
  normal = normalize(normal);
  centroid = centroid / area;
  PolygonCenter center{{centroid, {}}, normal};  // kept if the triangles face opposite ways and have no mean
  double nearest = -std::numeric_limits<double>::infinity();
  for_each_triangle([&](const Vec3& a, const Vec3& b, const Vec3& c) {
    const Vec3 to_a = a - centroid, to_b = b - centroid, to_c = c - centroid;
    Vec3 weights{dot(cross(to_b, to_c), normal), dot(cross(to_c, to_a), normal), dot(cross(to_a, to_b), normal)};
    weights = weights / (weights.x + weights.y + weights.z);
    const double inside = std::min({weights.x, weights.y, weights.z});
    if (!(inside > nearest)) return;
    nearest = inside;
    weights = {std::max(weights.x, 0.0), std::max(weights.y, 0.0), std::max(weights.z, 0.0)};
    center.point.position = (a * weights.x + b * weights.y + c * weights.z) / (weights.x + weights.y + weights.z);
    // In each direction, because it is offset along the normal of any of the triangles.
    const double error = max_component(abs(a) + abs(b) + abs(c)) * rounding_bound(32);
    center.point.error = {error, error, error};
  });
  return center;
}

void add_polygon_centers(const std::vector<std::uint8_t>& continues, TriangleGeometry& mesh) {
  for (std::size_t first = 0, end = 1; first < mesh.triangles.size(); first = end++) {
    while (end < continues.size() && continues[end] != 0) ++end;
    mesh.polygon_centers.resize(end, polygon_center(mesh, first, end));
  }
}

/// Sorts objects into geometries: opaque and transmissive ones of spheres, quadrics and single triangles (their masks
/// differ), and one for each mesh. Opaque objects without shadow are among the transmissive ones.
class GeometryBuilder {
 public:
  GeometryBuilder(CompiledScene& compiled, std::vector<Object>* taken, const RenderControl& control)
      : compiled_(compiled), taken_(taken), control_(control), render_from_world_(compiled.frame.affine()) {}

  void add(const Placed& placed) {
    if (control_.cancelled()) return;
    object_ = static_cast<std::uint32_t>(compiled_.objects.material.size());
    compiled_.objects.material.push_back(placed.material.index);
    compiled_.objects.shadowless.push_back(placed.shadow ? 0 : 1);
    transmissive_ = lets_light_pass(compiled_.materials[placed.material.index]) || !placed.shadow;
    if (compiled_.needs.textures) compiled_.objects.uv_axes.emplace_back();
    if (transmissive_) {
      compiled_.objects.diagonal.resize(object_ + 1);
      compiled_.objects.diagonal.back() = diagonal_of(placed);
      compiled_.objects.boundary.resize(object_ + 1);
      compiled_.objects.boundary.back() = medium_boundary(placed.shape, compiled_.materials[placed.material.index]);
    }
    render_from_object_ = render_from_world_ * placed.world_from_object;
    world_from_object_ = placed.world_from_object;
    const bool is_own = taken_ != nullptr && placed.group == "/objects";  // and so placed once
    own_mesh_ = is_own ? std::get_if<Mesh>(&(*taken_)[placed.index].shape) : nullptr;
    std::visit(*this, placed.shape);
  }

  GeometrySet finish() {
    for (SphereGeometry& spheres : spheres_)
      if (!spheres.x.empty()) set_.spheres.push_back(std::move(spheres));
    for (QuadricGeometry& quadrics : quadrics_)
      if (!quadrics.quadrics.empty()) set_.quadrics.push_back(std::move(quadrics));
    for (TriangleGeometry& triangles : loose_)
      if (!triangles.triangles.empty()) set_.triangles.push_back(std::move(triangles));
    return std::move(set_);
  }

  void operator()(const Sphere& sphere) {
    if (!keeps_spheres(world_from_object_.linear)) {
      add_quadric(sphere);
      return;
    }
    SphereGeometry& spheres = spheres_[transmissive_ ? 1 : 0];
    spheres.transmissive = transmissive_;
    const Vec3 center = render_from_object(sphere.center);
    spheres.x.push_back(center.x);
    spheres.y.push_back(center.y);
    spheres.z.push_back(center.z);
    spheres.radius.push_back(compiled_.frame.render_from_world(sphere.radius * world_from_object_.linear.x.x));
    spheres.object.push_back(object_);
    if (compiled_.needs.textures)
      compiled_.objects.uv_axes.back() = axes_across(normalize(sphere.axis), sphere.meridian);
  }

  void operator()(const Plane& plane) {
    PlaneGeometry& planes = set_.planes;
    const Vec3 normal = normalize(plane.normal);
    planes.point.push_back(render_from_object(plane.point));
    planes.normal.push_back(normalize(transformed_normal(world_from_object_.linear, normal)));
    planes.object.push_back(object_);
    planes.transmissive.push_back(transmissive_ ? 1 : 0);
    if (!compiled_.needs.textures) return;
    // u and v are linear in the position: their gradients transform by the inverse transpose, like normals.
    const Axes axes = axes_across(normal, plane.u_axis.value_or(Vec3{1, 0, 0}));
    const Linear gradients = transposed(inverse(world_from_object_.linear));
    compiled_.objects.uv_axes.back() = {gradients * axes.e0, gradients * axes.e1, normal};
  }

  template <Analytic S>
  void operator()(const S& shape) {
    add_quadric(shape);
  }

  void operator()(const Triangle& triangle) {
    TriangleGeometry& triangles = loose_[transmissive_ ? 1 : 0];
    triangles.transmissive = transmissive_;
    const auto first = static_cast<std::uint32_t>(triangles.positions.size());
    for (const Vec3& vertex : triangle.vertices) triangles.positions.push_back(render_from_object(vertex));
    triangles.triangles.push_back(mirrors() ? std::array{first, first + 2, first + 1}
                                            : std::array{first, first + 1, first + 2});
    triangles.object_of_triangle.push_back(object_);
    // A zero normal selects the face normal.
    for (std::size_t corner = 0; corner < 3; ++corner) {
      triangles.normals.push_back(unit_normal(triangle.normals ? (*triangle.normals)[corner] : Vec3{}));
      const Vec2 uv = triangle.uvs ? (*triangle.uvs)[corner] : Vec2{corner == 1 ? 1.0 : 0.0, corner == 2 ? 1.0 : 0.0};
      triangles.uvs.push_back({uv.x, uv.y});
    }
  }

  void operator()(const Mesh& mesh) {
    TriangleGeometry triangles;
    triangles.object = object_;
    triangles.transmissive = transmissive_;
    if (!mesh.normals.empty()) {
      set_normals(triangles, mesh.normals);
    } else if (mesh.smooth) {
      set_normals(triangles, area_weighted_normals(mesh));
    }
    triangles.uvs.reserve(mesh.uvs.size());
    for (const Vec2& uv : mesh.uvs) triangles.uvs.push_back({uv.x, uv.y});
    if (own_mesh_ != nullptr) {
      triangles.positions = std::move(own_mesh_->positions);
      triangles.triangles = std::move(own_mesh_->triangles);
      own_mesh_->smooth |= !mesh.normals.empty();
      own_mesh_->normals = {};
      own_mesh_->uvs = {};
    } else {
      triangles.positions = mesh.positions;
      triangles.triangles = mesh.triangles;
    }
    each(triangles.positions, [&](Vec3& position) { position = render_from_object(position); });
    if (mirrors()) each(triangles.triangles, [](auto& corners) { std::swap(corners[1], corners[2]); });
    const bool is_flat =
        compiled_.materials[compiled_.objects.material[object_]].shading == Material::Shading::flat_polygon;
    if (is_flat && !mesh.continues_polygon.empty()) add_polygon_centers(mesh.continues_polygon, triangles);
    set_.triangles.push_back(std::move(triangles));
  }

  void operator()(const Instance&) {}  // for_each_placed has resolved them

 private:
  /// Returns early after cancellation: a mesh of ten million triangles takes seconds.
  template <class Values, class Visit>
  void each(Values& values, const Visit& visit) const {
    constexpr std::size_t at_once = 1u << 16;  // about a millisecond
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (i % at_once == 0 && control_.cancelled()) return;
      visit(values[i]);
    }
  }

  template <Analytic S>
  void add_quadric(const S& shape) {
    QuadricGeometry& quadrics = quadrics_[transmissive_ ? 1 : 0];
    quadrics.transmissive = transmissive_;
    quadrics.object.push_back(object_);
    const auto image = standard_image(shape);
    const auto& [linear, offset] = image.object_from_standard;
    quadrics.quadrics.push_back(quadric(image, {render_from_object_.linear * linear, render_from_object(offset)}));
  }

  /// The frame subtracts its origin before it scales, so that objects without a transform are rounded once only.
  [[nodiscard]] Vec3 render_from_object(const Vec3& p) const {
    return compiled_.frame.render_from_world(world_from_object_.point(p));
  }

  /// A reflection reverses the winding of triangles; their front sides must stay the front.
  [[nodiscard]] bool mirrors() const { return determinant(world_from_object_.linear) < 0; }

  void set_normals(TriangleGeometry& triangles, const std::vector<Vec3>& normals) const {
    triangles.normals.reserve(normals.size());
    each(normals, [&](const Vec3& normal) { triangles.normals.push_back(unit_normal(normal)); });
  }

  [[nodiscard]] std::array<float, 3> unit_normal(const Vec3& normal) const {
    const Vec3 n = normalize(transformed_normal(world_from_object_.linear, normalize(normal)));
    return {static_cast<float>(n.x), static_cast<float>(n.y), static_cast<float>(n.z)};
  }

  CompiledScene& compiled_;
  std::vector<Object>* taken_;
  Mesh* own_mesh_ = nullptr;  ///< the mesh being added, if its vertices may be moved
  const RenderControl& control_;
  GeometrySet set_;
  Affine render_from_world_, world_from_object_, render_from_object_;
  std::array<SphereGeometry, 2> spheres_;
  std::array<QuadricGeometry, 2> quadrics_;
  std::array<TriangleGeometry, 2> loose_;
  std::uint32_t object_ = 0;
  bool transmissive_ = false;
};

}  // namespace

GeometrySet build_geometry(const Scene& scene, CompiledScene& compiled, std::vector<Object>* taken,
                           const RenderControl& control) {
  GeometryBuilder builder(compiled, taken, control);
  for_each_placed(scene, [&](const Placed& placed) { builder.add(placed); });
  return builder.finish();
}

}  // namespace tracer
