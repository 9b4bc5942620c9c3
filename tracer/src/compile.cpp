#include "tracer/compile.h"

#include <new>
#include <numeric>

#include "tracer/src/compiled_scene.h"

namespace tracer {
namespace {

/// Area-weighted vertex normals: the cross product of two edges is twice the area times the unit normal
/// (Gouraud 1971; weights compared by Max 1999). Vertices whose sum vanishes stay zero: shading falls back to the face.
std::vector<Vec3> area_weighted_normals(const Mesh& mesh) {
  std::vector<Vec3> normals(mesh.positions.size());
  for (const auto& [a, b, c] : mesh.triangles) {
    const Vec3 weighted = cross(mesh.positions[b] - mesh.positions[a], mesh.positions[c] - mesh.positions[a]);
    normals[a] += weighted;
    normals[b] += weighted;
    normals[c] += weighted;
  }
  return normals;
}

std::array<float, 3> unit_floats(const Vec3& v) {
  const Vec3 n = normalize(v);
  return {static_cast<float>(n.x), static_cast<float>(n.y), static_cast<float>(n.z)};
}

/// Sorts the scene's objects into geometries: spheres and loose triangles by whether they let light through (their
/// masks differ), each mesh by itself.
class GeometryBuilder {
 public:
  GeometryBuilder(const Scene& scene, CompiledScene& compiled) : scene_(scene), compiled_(compiled) {}

  void build() {
    for (std::uint32_t i = 0; i < scene_.objects.size(); ++i) {
      object_ = i;
      const Material& material = scene_.materials[scene_.objects[i].material.index];
      compiled_.material_of_object.push_back(scene_.objects[i].material.index);
      transmissive_ = material.transmission > 0;
      if (compiled_.needs.textures) compiled_.axes_of_object.emplace_back();
      std::visit(*this, scene_.objects[i].shape);
    }
    GeometrySet& set = compiled_.geometry;
    for (SphereGeometry& spheres : spheres_)
      if (!spheres.x.empty()) set.spheres.push_back(std::move(spheres));
    for (TriangleGeometry& triangles : loose_)
      if (!triangles.triangles.empty()) set.triangles.push_back(std::move(triangles));
    for (TriangleGeometry& triangles : set.triangles) triangles.positions.resize(triangles.positions.size() + 4);
  }

  void operator()(const Sphere& sphere) {
    SphereGeometry& spheres = spheres_[transmissive_ ? 1 : 0];
    spheres.transmissive = transmissive_;
    const Vec3 center = compiled_.frame.trace_from_world(sphere.center);
    spheres.x.push_back(center.x);
    spheres.y.push_back(center.y);
    spheres.z.push_back(center.z);
    spheres.radius.push_back(compiled_.frame.trace_from_world(sphere.radius));
    spheres.object.push_back(object_);
    set_axes(normalize(sphere.axis), sphere.meridian);
  }

  void operator()(const Plane& plane) {
    PlaneGeometry& planes = compiled_.geometry.planes;
    const Vec3 normal = normalize(plane.normal);
    planes.point.push_back(compiled_.frame.trace_from_world(plane.point));
    planes.normal.push_back(normal);
    planes.object.push_back(object_);
    planes.transmissive.push_back(transmissive_ ? 1 : 0);
    set_axes(normal, plane.u_axis.value_or(Vec3{1, 0, 0}));
  }

  void operator()(const Triangle& triangle) {
    TriangleGeometry& triangles = loose_[transmissive_ ? 1 : 0];
    triangles.transmissive = transmissive_;
    const auto first = static_cast<std::uint32_t>(triangles.positions.size() / 3);
    for (const Vec3& vertex : triangle.vertices) push_position(triangles, vertex);
    triangles.triangles.push_back({first, first + 1, first + 2});
    triangles.object_of_triangle.push_back(object_);
    // Zero normals mean: use the face's.
    for (int corner = 0; corner < 3; ++corner) {
      triangles.normals.push_back(unit_floats(triangle.normals ? (*triangle.normals)[corner] : Vec3{}));
      const Vec2 uv = triangle.uvs ? (*triangle.uvs)[corner] : Vec2{corner == 1 ? 1.0 : 0.0, corner == 2 ? 1.0 : 0.0};
      triangles.uvs.push_back({uv.x, uv.y});
    }
  }

  void operator()(const Mesh& mesh) {
    if (mesh.triangles.empty()) return;
    TriangleGeometry triangles;
    triangles.object = object_;
    triangles.transmissive = transmissive_;
    triangles.positions.reserve(3 * mesh.positions.size() + 4);
    for (const Vec3& position : mesh.positions) push_position(triangles, position);
    triangles.triangles = mesh.triangles;
    if (!mesh.normals.empty()) {
      for (const Vec3& normal : mesh.normals) triangles.normals.push_back(unit_floats(normal));
    } else if (mesh.smooth) {
      for (const Vec3& normal : area_weighted_normals(mesh)) triangles.normals.push_back(unit_floats(normal));
    }
    for (const Vec2& uv : mesh.uvs) triangles.uvs.push_back({uv.x, uv.y});
    compiled_.geometry.triangles.push_back(std::move(triangles));
  }

 private:
  void push_position(TriangleGeometry& triangles, const Vec3& world) const {
    const Vec3 p = compiled_.frame.trace_from_world(world);
    for (const double coordinate : {p.x, p.y, p.z}) triangles.positions.push_back(static_cast<float>(coordinate));
  }
  void set_axes(const Vec3& normal, const Vec3& first) {
    if (compiled_.needs.textures) compiled_.axes_of_object.back() = axes_across(normal, first);
  }

  const Scene& scene_;
  CompiledScene& compiled_;
  std::array<SphereGeometry, 2> spheres_;
  std::array<TriangleGeometry, 2> loose_;
  std::uint32_t object_ = 0;
  bool transmissive_ = false;
};

TraceLight trace_light(const Light& light, const TraceFrame& frame) {
  TraceLight traced;
  traced.radiance = light.color * light.intensity;
  traced.shadows = light.shadows;
  traced.attenuation = light.attenuation;
  if (const auto* directional = std::get_if<DirectionalLight>(&light.source)) {
    traced.directional = true;
    traced.to_light = -normalize(directional->direction);
  } else {
    traced.position = frame.trace_from_world(std::get<PointLight>(light.source).position);
  }
  return traced;
}

template <class T>
std::uint64_t bytes_of(const std::vector<T>& values) {
  return values.capacity() * sizeof(T);
}

}  // namespace

Result<std::shared_ptr<const CompiledScene>, Failure> compile(const Scene& scene, RenderControl& control) {
  if (control.cancelled()) return Failure{Failure::Code::cancelled, "cancelled before building"};
  try {
    auto compiled = std::make_shared<CompiledScene>(scene, TraceFrame(finite_bounds(scene)));
    GeometryBuilder(scene, *compiled).build();
    for (const Light& light : scene.lights) compiled->lights.push_back(trace_light(light, compiled->frame));
    auto accelerator = Accelerator::build(compiled->geometry, control);
    if (!accelerator) return accelerator.error();
    compiled->accelerator = std::move(*accelerator);
    return std::shared_ptr<const CompiledScene>(std::move(compiled));
  } catch (const std::bad_alloc&) {
    return Failure{Failure::Code::out_of_memory, "no memory for the compiled scene"};
  }
}

std::uint64_t memory_bytes(const CompiledScene& scene) {
  std::uint64_t bytes = scene.accelerator->memory_bytes() + bytes_of(scene.lights) + bytes_of(scene.materials) +
                        bytes_of(scene.material_of_object) + bytes_of(scene.axes_of_object);
  for (const SphereGeometry& s : scene.geometry.spheres)
    bytes += bytes_of(s.x) + bytes_of(s.y) + bytes_of(s.z) + bytes_of(s.radius) + bytes_of(s.object);
  for (const TriangleGeometry& t : scene.geometry.triangles)
    bytes += bytes_of(t.positions) + bytes_of(t.triangles) + bytes_of(t.normals) + bytes_of(t.uvs) +
             bytes_of(t.object_of_triangle);
  return bytes;
}

}  // namespace tracer
