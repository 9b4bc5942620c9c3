#include "server/worker/render_job.h"

#include <chrono>
#include <limits>
#include <new>
#include <string_view>
#include <utility>

#include "api/document.h"
#include "api/load_assets.h"
#include "api/report.h"
#include "server/worker/scene_files.h"
#include "tracer/compile.h"
#include "tracer/encode.h"
#include "tracer/render.h"

namespace worker {
namespace {

/// Milliseconds between laps, and since the last.
class Stopwatch {
 public:
  [[nodiscard]] double elapsed() const {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - last_).count();
  }
  double lap() {
    const auto now = std::chrono::steady_clock::now();
    return std::chrono::duration<double, std::milli>(now - std::exchange(last_, now)).count();
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

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

jobs::Problem problem_of_files(std::vector<tracer::Issue> issues) {
  return {"bad_asset", "The scene cannot be rendered with its files.", std::move(issues)};
}

jobs::Problem problem_of(const api::Refusal& refusal) {
  const std::string detail =
      refusal.detail.empty() ? "The scene has " + std::to_string(refusal.issues.size()) + " mistakes." : refusal.detail;
  return {"bad_scene", detail, refusal.issues};
}

/// Thrown to leave a stage; caught in render_job alone.
struct Stop {
  Outcome outcome;
};

class Rendering {
 public:
  Rendering(Assign job, const FileSettings& files, tracer::RenderControl& control, tracer::GeometryCache* geometry)
      : job_(std::move(job)), files_(files), control_(control), geometry_(geometry) {
    times_.queue = job_.queue_ms;
  }

  Finished run() {
    tracer::Scene scene = parse();
    const auto compiled = compile(scene);
    tracer::Rendered rendered = trace(*compiled);
    Finished finished{job_.job_id, job_.fence, {}, encode(rendered.image, scene.output)};
    finished.report = api::write_report(scene, rendered.error, rendered.statistics, times_, memory_bytes_);
    return finished;
  }

 private:
  tracer::Scene parse() {
    api::Limits limits = no_limits();
    if (!files_.folder.empty()) limits.files = api::Files::below_a_folder;
    limits.uploads = !files_.uploads.empty();
    auto document = api::parse_scene(job_.document, limits);
    if (!document) throw Stop{Failed{job_.job_id, job_.fence, problem_of(document.error())}};
    job_.document = std::string();  // it may be large, and is not needed any more
    times_.parse = watch_.lap();
    return std::move(document->scene);
  }

  /// With its files, whose bytes are not needed afterwards.
  std::shared_ptr<const tracer::CompiledScene> compile(tracer::Scene& scene) {
    const tracer::Assets assets = scene.assets.empty() ? tracer::Assets() : load_assets(scene);
    times_.parse += watch_.lap();
    auto compiled = value_of(tracer::compile(scene, control_, assets, geometry_));
    times_.build = watch_.lap();
    times_.geometry_reused = tracer::reused_geometry(*compiled);
    return compiled;
  }

  tracer::Assets load_assets(tracer::Scene& scene) {
    tracer::Limits limits = no_limits().scene;
    limits.objects = files_.objects;
    limits.triangles = files_.triangles;
    const SceneFiles files(files_);
    auto assets = api::load_assets(
        scene,
        [&](const std::string& name) {
          if (control_.cancelled()) throw Stop{Cancelled{job_.job_id, job_.fence}};
          return files.read(name);
        },
        limits);
    if (!assets) throw Stop{Failed{job_.job_id, job_.fence, problem_of_files(std::move(assets.error()))}};
    return std::move(*assets);
  }

  tracer::Rendered trace(const tracer::CompiledScene& compiled) {
    // A time budget is of building and tracing.
    const auto elapsed_ms = [&] { return times_.build + watch_.elapsed(); };
    tracer::Rendered rendered = value_of(tracer::render(compiled, {.elapsed_ms = elapsed_ms}, control_));
    times_.trace = watch_.lap();
    memory_bytes_ = tracer::memory_bytes(compiled) + rendered.image.rgb.size() * sizeof(float);
    return rendered;
  }

  std::vector<Picture> encode(const tracer::Image& image, const tracer::Output& output) {
    std::vector<Picture> pictures;
    for (const tracer::Format format : output.formats) {
      if (control_.cancelled()) throw Stop{Cancelled{job_.job_id, job_.fence}};
      const auto encoded = tracer::encode(image, format, output);
      if (!encoded) throw Stop{failed("internal", encoded.error())};
      memory_bytes_ += encoded->size();
      const std::string_view bytes(reinterpret_cast<const char*>(encoded->data()), encoded->size());
      pictures.push_back({"image." + std::string(tracer::extension(format)), std::string(tracer::media_type(format)),
                          sealed_memory(bytes)});
    }
    times_.encode = watch_.lap();
    return pictures;
  }

  template <class T>
  T value_of(tracer::Result<T, tracer::Failure> result) {
    using Code = tracer::Failure::Code;
    if (result) return *std::move(result);
    if (result.error().code == Code::cancelled) throw Stop{Cancelled{job_.job_id, job_.fence}};
    if (result.error().code == Code::bad_asset) {
      throw Stop{Failed{job_.job_id, job_.fence,
                        problem_of_files({{result.error().pointer, "bad_asset", result.error().detail}})}};
    }
    const bool memory = result.error().code == Code::out_of_memory;
    throw Stop{failed(memory ? "out_of_memory" : "internal", result.error().detail)};
  }

  Failed failed(const char* code, const std::string& detail) const {
    return {job_.job_id, job_.fence, {code, detail, {}}};
  }

  Assign job_;
  const FileSettings& files_;
  tracer::RenderControl& control_;
  tracer::GeometryCache* geometry_;
  Stopwatch watch_;
  api::StageTimes times_;
  std::uint64_t memory_bytes_ = 0;  ///< what was largest at its time: the compiled scene, the picture, the files
};

}  // namespace

Outcome render_job(Assign job, const FileSettings& files, tracer::RenderControl& control,
                   tracer::GeometryCache* geometry) noexcept {
  Failed failure{job.job_id, job.fence, {}};
  try {
    return Rendering(std::move(job), files, control, geometry).run();
  } catch (Stop& stop) {
    return std::move(stop.outcome);
  } catch (const std::bad_alloc&) {
    failure.problem = {"out_of_memory", "The worker has not enough memory for this scene.", {}};
  } catch (const std::exception& exception) {
    failure.problem = {"internal", exception.what(), {}};
  }
  return failure;
}

}  // namespace worker
