#include <chrono>
#include <string_view>
#include <utility>

#include "api/document.h"
#include "api/report.h"
#include "server/worker/process/jobs.h"
#include "tracer/compile.h"
#include "tracer/encode.h"
#include "tracer/render.h"

namespace worker {
namespace {

/// Measures milliseconds since the last lap.
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

class RenderStages {
 public:
  RenderStages(Assign job, const FileSettings& files, JobControl& control, tracer::SceneCache* cache)
      : job_(std::move(job)), files_(files), control_(control), cache_(cache) {
    times_.queue = job_.queue_ms;
  }

  Finished run() {
    tracer::Scene scene = parse();
    const auto compiled = compile(scene);
    control_.display_output.exposure = scene.output.exposure;
    control_.display_output.overflow = scene.output.overflow;
    tracer::Rendered rendered = trace(*compiled);
    Finished finished{job_.job_id, job_.fence, {}, encode(rendered.image, scene.output)};
    finished.report = api::write_report(scene, rendered.error, rendered.statistics, times_, memory_bytes_);
    return finished;
  }

 private:
  tracer::Scene parse() {
    auto document = api::parse_scene(job_.document, reading_limits(files_));
    if (!document) stop_for(document.error());
    job_.document = std::string();  // it may be large
    times_.parse = watch_.lap();
    return std::move(document->scene);
  }

  /// Frees the bytes of files and the meshes of `scene`.
  std::shared_ptr<const tracer::CompiledScene> compile(tracer::Scene& scene) {
    stop_if_cancelled(control_.tracing);
    std::shared_ptr<tracer::SceneCacheEntry> entry;
    if (cache_ != nullptr) entry = value_of(cache_->acquire(scene, content_names(scene, files_), control_.tracing));
    const tracer::Assets assets = load_files(scene, files_, control_.tracing);
    times_.parse += watch_.lap();
    auto compiled = value_of(tracer::compile_taking_meshes(scene, control_.tracing, assets, entry.get()));
    times_.build = watch_.lap();
    times_.cache_hits = tracer::cache_hits(*compiled);
    return compiled;
  }

  tracer::Rendered trace(const tracer::CompiledScene& compiled) {
    // A time budget includes compilation and tracing.
    const auto elapsed_ms = [&] { return times_.build + watch_.elapsed(); };
    tracer::Rendered rendered =
        value_of(tracer::render(compiled, {.elapsed_ms = elapsed_ms, .preview = &control_.preview}, control_.tracing));
    times_.trace = watch_.lap();
    memory_bytes_ = tracer::memory_bytes(compiled) + rendered.image.rgb.size() * sizeof(float);
    return rendered;
  }

  std::vector<Image> encode(const tracer::Image& image, const tracer::Output& output) {
    std::vector<Image> images;
    for (const tracer::Format format : output.formats) {
      stop_if_cancelled(control_.tracing);
      const auto encoded = tracer::encode(image, format, output);
      if (!encoded) throw Stop{queue::Problem{"internal", encoded.error(), {}}};
      memory_bytes_ += encoded->size();
      const std::string_view bytes(reinterpret_cast<const char*>(encoded->data()), encoded->size());
      images.push_back({"image." + std::string(tracer::extension(format)), std::string(tracer::media_type(format)),
                        sealed_memory(bytes)});
    }
    times_.encode = watch_.lap();
    return images;
  }

  Assign job_;
  const FileSettings& files_;
  JobControl& control_;
  tracer::SceneCache* cache_;
  Stopwatch watch_;
  api::StageTimes times_;
  std::uint64_t memory_bytes_ = 0;  ///< size of the compiled scene, the image and the encoded files
};

}  // namespace

Outcome render_job(Assign job, const FileSettings& files, JobControl& control, tracer::SceneCache* cache) noexcept {
  const std::string id = job.job_id;
  const std::int64_t fence = job.fence;
  return outcome_of(id, fence, [&] { return RenderStages(std::move(job), files, control, cache).run(); });
}

}  // namespace worker
