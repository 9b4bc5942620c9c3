#include "api/estimate.h"

#include <algorithm>
#include <variant>

namespace api {
namespace {

constexpr std::uint64_t pixel_bytes = 40, adaptive_pixel_bytes = 140, layer_pixel_bytes = 30;
constexpr std::uint64_t triangle_bytes = 150, object_bytes = 650;

std::uint64_t bytes_of(const std::vector<tracer::Object>& objects) {
  std::uint64_t bytes = objects.size() * object_bytes;
  for (const tracer::Object& object : objects) {
    const auto* mesh = std::get_if<tracer::Mesh>(&object.shape);
    if (mesh != nullptr) bytes += mesh->triangles.size() * triangle_bytes;
  }
  return bytes;
}

bool has_mesh_files(const std::vector<tracer::Object>& objects) {
  return std::any_of(objects.begin(), objects.end(), [](const tracer::Object& object) {
    const auto* mesh = std::get_if<tracer::Mesh>(&object.shape);
    return mesh != nullptr && mesh->file;
  });
}

bool has_mesh_files(const tracer::Scene& scene) {
  return has_mesh_files(scene.objects) ||
         std::any_of(scene.prototypes.begin(), scene.prototypes.end(),
                     [](const tracer::Prototype& prototype) { return has_mesh_files(prototype.objects); });
}

bool takes_many_samples(const tracer::Scene& scene) {
  constexpr std::uint64_t few_samples = 1u << 21;
  constexpr double short_time_ms = 2000;
  const std::optional<tracer::Adaptive>& adaptive = scene.accuracy.adaptive;
  if (adaptive && adaptive->time_budget_ms && *adaptive->time_budget_ms <= short_time_ms) return false;
  const std::uint64_t each = adaptive ? adaptive->samples_max : scene.accuracy.samples;
  return scene.image.window().pixels() * each > few_samples;
}

}  // namespace

std::uint64_t estimated_memory_bytes(const tracer::Scene& scene) {
  const std::uint64_t each =
      (scene.accuracy.adaptive ? adaptive_pixel_bytes : pixel_bytes) + scene.output.layers.size() * layer_pixel_bytes;
  std::uint64_t bytes = scene.image.window().pixels() * each + bytes_of(scene.objects);
  for (const tracer::Prototype& prototype : scene.prototypes) bytes += bytes_of(prototype.objects);
  return bytes;
}

bool is_large(const tracer::Scene& scene) {
  return takes_many_samples(scene) || estimated_memory_bytes(scene) > 256u << 20 || has_mesh_files(scene);
}

}  // namespace api
