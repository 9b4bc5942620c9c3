#include "server/worker/process/jobs.h"

#include <limits>
#include <new>

#include "api/load_assets.h"
#include "server/worker/protocol/asset_directory.h"

namespace worker {
namespace {

template <class T>
constexpr T unlimited = std::numeric_limits<T>::max();

api::Limits no_limits() {
  api::Limits limits;
  limits.document.bytes = limits.document.values = limits.document.string_bytes = unlimited<std::size_t>;
  tracer::Limits& scene = limits.scene;
  scene.pixels = scene.samples_times_pixels = scene.objects = scene.triangles = unlimited<std::uint64_t>;
  scene.lights = scene.materials = unlimited<std::uint32_t>;
  return limits;
}

queue::Problem bad_asset(std::vector<tracer::Issue> issues) {
  return {"bad_asset", "The scene cannot be rendered with its files.", std::move(issues)};
}

}  // namespace

Outcome outcome_of(const std::string& job_id, std::int64_t fence, const std::function<Finished()>& work) noexcept {
  Failed failure{job_id, fence, {}};
  try {
    return work();
  } catch (Stop& stop) {
    if (!stop.problem) return Cancelled{job_id, fence};
    failure.problem = std::move(*stop.problem);
  } catch (const std::bad_alloc&) {
    failure.problem = {"out_of_memory", "The worker does not have enough memory for this scene.", {}};
  } catch (const std::exception& exception) {
    failure.problem = {"internal", exception.what(), {}};
  }
  return failure;
}

api::Limits reading_limits(const FileSettings& files) {
  api::Limits limits = no_limits();
  if (!files.directory.empty()) limits.files = api::Files::below_a_directory;
  limits.uploads = !files.uploads.empty();
  return limits;
}

std::vector<std::string> content_names(const tracer::Scene& scene, const FileSettings& settings) {
  std::vector<std::string> names;
  if (scene.assets.empty()) return names;
  const SceneFiles files(settings);
  for (const tracer::Asset& asset : scene.assets) names.push_back(files.content_name(asset.name));
  return names;
}

tracer::Assets load_files(tracer::Scene& scene, const FileSettings& settings, const tracer::RenderControl& control) {
  if (scene.assets.empty()) return {};
  tracer::Limits limits = no_limits().scene;
  limits.objects = settings.objects;
  limits.triangles = settings.triangles;
  const SceneFiles files(settings);
  const auto read = [&](const std::string& name) {
    stop_if_cancelled(control);
    return files.read(name);
  };
  auto assets = api::load_assets(scene, read, limits);
  if (!assets) throw Stop{bad_asset(std::move(assets.error()))};
  return std::move(*assets);
}

void stop_for(const api::Refusal& refusal) {
  const std::string detail =
      refusal.detail.empty() ? "The scene has " + std::to_string(refusal.issues.size()) + " errors." : refusal.detail;
  throw Stop{queue::Problem{"bad_scene", detail, refusal.issues}};
}

void stop_for(const tracer::Failure& failure) {
  using Code = tracer::Failure::Code;
  if (failure.code == Code::cancelled) throw Stop{};
  if (failure.code == Code::bad_asset) throw Stop{bad_asset({{failure.pointer, "bad_asset", failure.detail}})};
  const char* const code = failure.code == Code::out_of_memory ? "out_of_memory" : "internal";
  throw Stop{queue::Problem{code, failure.detail, {}}};
}

}  // namespace worker
