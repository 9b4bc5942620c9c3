#include "api/estimate.h"

#include <algorithm>
#include <cmath>
#include <variant>

#include "tracer/requirements.h"
#include "tracer/warnings.h"

namespace api {
namespace {

constexpr std::uint64_t pixel_bytes = 40, adaptive_pixel_bytes = 90, layer_pixel_bytes = 30, measure_pixel_bytes = 150,
                        proof_pixel_bytes = 8;
constexpr std::uint64_t triangle_bytes = 150, object_bytes = 650, proof_element_bytes = 128;
constexpr std::uint64_t few_patches_bytes = 64u << 20, many_patches_bytes = 320u << 20;

/// Objects and triangles of the scene and its prototypes.
struct Counts {
  std::uint64_t objects = 0, triangles = 0;
  bool mesh_files = false;

  explicit Counts(const tracer::Scene& scene) {
    add(scene.objects);
    for (const tracer::Prototype& prototype : scene.prototypes) add(prototype.objects);
  }
  void add(const std::vector<tracer::Object>& added) {
    objects += added.size();
    for (const tracer::Object& object : added) {
      const auto* mesh = std::get_if<tracer::Mesh>(&object.shape);
      if (mesh == nullptr) continue;
      triangles += mesh->triangles.size();
      mesh_files |= mesh->file.has_value();
    }
  }
};

/// Error of the image when both targets are reached. The worst tile has about 3.5 times the image's error (geometric
/// mean over the example scenes).
std::optional<double> expected_error(const tracer::Adaptive& adaptive) {
  constexpr double tile_ratio = 3.5;
  if (!adaptive.tile_error) return adaptive.target_error;
  const double of_tile = *adaptive.tile_error / tile_ratio;
  return std::min(adaptive.target_error.value_or(of_tile), of_tile);
}

/// Mean samples per pixel.
std::optional<double> expected_samples(const tracer::Accuracy& accuracy) {
  const bool paths = accuracy.model == tracer::Accuracy::Model::global;  // as in a Cornell box
  const double at_one_level = paths ? 900 : 22, power = paths ? 1.9 : 1.26;
  if (!accuracy.adaptive) return accuracy.samples;
  const tracer::Adaptive& adaptive = *accuracy.adaptive;
  const std::optional<double> error = expected_error(adaptive);
  if (!error) return std::nullopt;
  return std::clamp(at_one_level * std::pow(*error, -power), static_cast<double>(adaptive.samples_min),
                    static_cast<double>(adaptive.samples_max));
}

/// Shadow rays per sample of a pixel with that many samples.
double shadow_rays(const tracer::Scene& scene, double samples) {
  constexpr double points_min = 16, rays_max = 64;  // of many lights most are culled
  const double points = std::max(1.0, points_min / samples);
  double rays = 0;
  for (const tracer::Light& light : scene.lights) {
    if (light.shadows) rays += tracer::is_area_light(light.source) ? points : 1;
  }
  return std::min(rays, rays_max);
}

double rays_per_sample(const tracer::Scene& scene) {
  const tracer::Requirements needs = tracer::requirements(scene);
  const double bounces = std::max(1 + (needs.reflection ? 0.5 : 0) + (needs.refraction ? 1.5 : 0),
                                  0.3 * tracer::predicted_rays(scene));  // trees cover a part of the image
  const double samples = expected_samples(scene.accuracy).value_or(scene.accuracy.samples);
  // Paths by diffuse surfaces have about two bounces, each with a ray toward an emitter.
  const double paths = needs.global_light ? 3 + (needs.emitters ? 2 : 0) : 1;
  return (1 + (needs.shadows ? shadow_rays(scene, samples) : 0)) * bounces * paths;
}

double work_of_samples(const tracer::Scene& scene, double samples, const SceneContent& content) {
  constexpr double job_rays = 20'000;
  return static_cast<double>(scene.image.window().pixels()) * samples * content.rays_per_sample +
         static_cast<double>(content.elements) + job_rays;
}

bool takes_many_samples(const tracer::Scene& scene) {
  constexpr double few_samples = 1u << 21;
  constexpr double short_time_ms = 2000;
  const std::optional<tracer::Adaptive>& adaptive = scene.accuracy.adaptive;
  if (adaptive && adaptive->time_budget_ms && *adaptive->time_budget_ms <= short_time_ms) return false;
  const std::optional<double> expected = expected_samples(scene.accuracy);
  const double each = expected ? *expected : adaptive->samples_max;  // unset for a time budget without a target
  return static_cast<double>(scene.image.window().pixels()) * each > few_samples;
}

/// Bytes of the patches of radiosity and of the light between them.
std::uint64_t patch_bytes(const tracer::Accuracy& accuracy) {
  constexpr double target_of_few = 4;
  if (!accuracy.uses_patches()) return 0;
  return accuracy.target().value_or(0) >= target_of_few ? few_patches_bytes : many_patches_bytes;
}

/// True if the measurement has settings of the parameter "model" (tracer::settings).
bool compares_models(const MeasureRequest& request) {
  if (request.parameters.empty()) return request.document.scene.accuracy.model == tracer::Accuracy::Model::global;
  return std::ranges::find(request.parameters, "model") != request.parameters.end();
}

}  // namespace

SceneContent content_of(const tracer::Scene& scene) {
  const Counts counts(scene);
  const bool named_files = std::ranges::any_of(
      scene.assets, [](const tracer::Asset& asset) { return !asset.name.starts_with(upload_prefix); });
  return {counts.objects * object_bytes + counts.triangles * triangle_bytes, counts.mesh_files, named_files,
          rays_per_sample(scene), counts.objects + counts.triangles};
}

std::uint64_t estimated_memory_bytes(const tracer::Scene& scene, const SceneContent& content) {
  const std::uint64_t each =
      (scene.accuracy.adaptive ? adaptive_pixel_bytes : pixel_bytes) + scene.output.layers.size() * layer_pixel_bytes;
  const std::uint64_t of_proof =
      scene.accuracy.proof ? scene.image.window().pixels() * proof_pixel_bytes + content.elements * proof_element_bytes
                           : 0;
  return scene.image.window().pixels() * each + patch_bytes(scene.accuracy) + of_proof + content.memory_bytes;
}

std::uint64_t estimated_memory_bytes(const tracer::Scene& scene) {
  return estimated_memory_bytes(scene, content_of(scene));
}

std::optional<double> estimated_proof_rays(const tracer::Scene& scene, const SceneContent& content) {
  constexpr double bound_samples = 4, samples_min = 1u << 14;
  const std::optional<double> samples = expected_samples(scene.accuracy);
  if (!samples) return std::nullopt;
  const auto pixels = static_cast<double>(scene.image.window().pixels());
  return (std::max(pixels * *samples, samples_min) + bound_samples * pixels) * content.rays_per_sample;
}

std::optional<double> estimated_work(const tracer::Scene& scene, const SceneContent& content,
                                     std::optional<double> seconds_per_work) {
  std::optional<double> work;
  if (const auto samples = expected_samples(scene.accuracy)) work = work_of_samples(scene, *samples, content);
  if (work && scene.accuracy.proof) *work += estimated_proof_rays(scene, content).value_or(0);
  const std::optional<tracer::Adaptive>& adaptive = scene.accuracy.adaptive;
  if (!adaptive || !adaptive->time_budget_ms || !seconds_per_work) return work;
  const double budget = *adaptive->time_budget_ms / 1000 / *seconds_per_work;
  return std::min(work.value_or(budget), budget);
}

std::optional<double> estimated_work(const tracer::Scene& scene) { return estimated_work(scene, content_of(scene)); }

double estimated_measure_work(const MeasureRequest& request) {
  const tracer::Scene& scene = request.document.scene;
  const double own = work_of_samples(scene, 2.0 * request.reference_samples, content_of(scene));
  if (!compares_models(request)) return own;
  tracer::Scene other = scene;
  using enum tracer::Accuracy::Model;
  other.accuracy.model = scene.accuracy.model == whitted ? global : whitted;
  other.accuracy.approximate.interreflection = tracer::Approximations::Interreflection::exact;
  return own + work_of_samples(other, 2.0 * request.reference_samples, content_of(other));
}

std::uint64_t estimated_measure_memory_bytes(const MeasureRequest& request) {
  const tracer::Scene& scene = request.document.scene;
  const std::uint64_t pixels = scene.image.window().pixels();
  const std::uint64_t adapting = scene.accuracy.adaptive ? 0 : adaptive_pixel_bytes - pixel_bytes;
  const std::uint64_t references = compares_models(request) ? 2 : 1;
  const std::uint64_t patches = compares_models(request) ? many_patches_bytes - patch_bytes(scene.accuracy) : 0;
  return estimated_memory_bytes(scene) + pixels * (adapting + references * measure_pixel_bytes) + patches;
}

bool is_large(const tracer::Scene& scene, const SceneContent& content) {
  return takes_many_samples(scene) || estimated_memory_bytes(scene, content) > 256u << 20 || content.mesh_files;
}

bool is_large(const tracer::Scene& scene) { return is_large(scene, content_of(scene)); }

}  // namespace api
