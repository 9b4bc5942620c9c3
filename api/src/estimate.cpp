#include "api/estimate.h"

#include <variant>

namespace api {
namespace {

constexpr std::uint64_t pixel_bytes = 40, adaptive_pixel_bytes = 140, layer_pixel_bytes = 30, measure_pixel_bytes = 150;
constexpr std::uint64_t triangle_bytes = 150, object_bytes = 650;

std::uint64_t bytes_of(const std::vector<tracer::Object>& objects) {
  std::uint64_t bytes = objects.size() * object_bytes;
  for (const tracer::Object& object : objects) {
    const auto* mesh = std::get_if<tracer::Mesh>(&object.shape);
    if (mesh != nullptr) bytes += mesh->triangles.size() * triangle_bytes;
  }
  return bytes;
}

}  // namespace

std::uint64_t estimated_memory_bytes(const tracer::Scene& scene) {
  const std::uint64_t each =
      (scene.accuracy.adaptive ? adaptive_pixel_bytes : pixel_bytes) + scene.output.layers.size() * layer_pixel_bytes;
  std::uint64_t bytes = scene.image.window().pixels() * each + bytes_of(scene.objects);
  for (const tracer::Prototype& prototype : scene.prototypes) bytes += bytes_of(prototype.objects);
  return bytes;
}

std::uint64_t estimated_measure_memory_bytes(const tracer::Scene& scene) {
  const std::uint64_t pixels = scene.image.window().pixels();
  const std::uint64_t adapting = scene.accuracy.adaptive ? 0 : adaptive_pixel_bytes - pixel_bytes;
  return estimated_memory_bytes(scene) + pixels * (adapting + measure_pixel_bytes);
}

}  // namespace api
