#include "tracer/compile.h"

#include <new>
#include <numeric>

#include "tracer/src/shapes/geometry_builder.h"

namespace tracer {
namespace {

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
    build_geometry(scene, *compiled);
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
  for (const QuadricGeometry& q : scene.geometry.quadrics) bytes += bytes_of(q.quadrics) + bytes_of(q.object);
  for (const TriangleGeometry& t : scene.geometry.triangles)
    bytes += bytes_of(t.positions) + bytes_of(t.triangles) + bytes_of(t.normals) + bytes_of(t.uvs) +
             bytes_of(t.object_of_triangle);
  return bytes;
}

}  // namespace tracer
