#include "server/worker/process/jobs.h"

#include <oneapi/tbb/task_arena.h>

#include <chrono>
#include <cstdio>
#include <functional>
#include <iterator>
#include <limits>
#include <new>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "api/document.h"
#include "api/load_assets.h"
#include "api/measurement_json.h"
#include "api/report.h"
#include "api/requests.h"
#include "server/worker/process/task_exchange.h"
#include "tracer/compile.h"
#include "tracer/encode.h"
#include "tracer/measure.h"
#include "tracer/plot.h"
#include "tracer/render.h"
#include "tracer/sha256.h"

namespace worker {
namespace {

// ---- stages of every job

/// Thrown to leave a stage; caught only by outcome_of.
struct Stop {
  std::optional<queue::Problem> problem;  ///< none: the job was cancelled
};

/// The result of `work`, or its exception as an answer: std::bad_alloc is "out_of_memory", an unexpected one
/// "internal".
Outcome outcome_of(const std::string& job_id, std::int64_t fence, const std::function<Finished()>& work) noexcept {
  Failed failure{job_id, fence, {}};
  try {
    return work();
  } catch (Stop& stop) {
    if (!stop.problem) return Cancelled{job_id, fence};
    failure.problem = std::move(*stop.problem);
  } catch (const std::bad_alloc&) {
    failure.problem = {"out_of_memory", "The worker does not have enough memory for this scene.", {}};
  } catch (const FilesUnavailable& unavailable) {
    failure.problem = {std::string(assets_unavailable), unavailable.what(), {}};
  } catch (const std::exception& exception) {
    failure.problem = {"internal", exception.what(), {}};
  }
  return failure;
}

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

/// Leaves the stage if the job is cancelled.
void stop_if_cancelled(const tracer::RenderControl& control) {
  if (control.cancelled()) throw Stop{};
}

/// As "bad_scene".
[[noreturn]] void stop_for(const api::Refusal& refusal) {
  const std::string detail =
      refusal.detail.empty() ? "The scene has " + std::to_string(refusal.issues.size()) + " errors." : refusal.detail;
  throw Stop{queue::Problem{"bad_scene", detail, refusal.issues}};
}

[[noreturn]] void stop_for(const tracer::Failure& failure) {
  using Code = tracer::Failure::Code;
  if (failure.code == Code::cancelled) throw Stop{};
  if (failure.code == Code::bad_asset) throw Stop{bad_asset({{failure.pointer, "bad_asset", failure.detail}})};
  const char* const code = failure.code == Code::out_of_memory ? "out_of_memory" : "internal";
  throw Stop{queue::Problem{code, failure.detail, {}}};
}

template <class T>
T value_of(tracer::Result<T, tracer::Failure> result) {
  if (!result) stop_for(result.error());
  return *std::move(result);
}

/// No limits on the document: they were checked when it was accepted, and may have changed since.
api::Limits reading_limits(const FileSettings& files) {
  api::Limits limits = no_limits();
  if (!files.directory.empty()) limits.files = api::Files::below_a_directory;
  limits.uploads = !files.uploads.empty();
  return limits;
}

/// Content identifiers of the files of `scene`, in their order, for tracer::SceneCache.
std::vector<std::string> content_names(const tracer::Scene& scene, const JobFiles& files) {
  std::vector<std::string> names;
  for (const tracer::Asset& asset : scene.assets) names.push_back(files.client->content_name(asset.name));
  return names;
}

/// Text that is equal only for documents that differ in nothing but the view.
std::string digest_without_view(const std::string& document, const api::Limits& limits) {
  api::Digests digests;
  if (!api::parse_scene(document, limits, &digests)) return {};
  for (const char* of_the_view : {"camera", "image", "output", "name"}) digests.erase(of_the_view);
  std::string text;
  for (const auto& [name, sha256] : digests) text.append(name).append(" ").append(sha256).append("\n");
  return text;
}

/// Loads the files of `scene`. Stops as "bad_asset" with all issues if they are invalid, and between files if the job
/// is cancelled.
tracer::Assets load_files(tracer::Scene& scene, const JobFiles& files, const tracer::RenderControl& control) {
  if (scene.assets.empty()) return {};
  tracer::Limits limits = no_limits().scene;
  limits.objects = files.settings.objects;
  limits.triangles = files.settings.triangles;
  const auto read = [&](const std::string& name) {
    stop_if_cancelled(control);
    return files.client->read(name);
  };
  auto assets = api::load_assets(scene, read, limits);
  if (!assets) throw Stop{bad_asset(std::move(assets.error()))};
  return std::move(*assets);
}

// ---- renders

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
  RenderStages(Assign job, const JobFiles& files, JobControl& control, tracer::SceneCache* cache,
               const TaskChannel* channel)
      : job_(std::move(job)), files_(files), control_(control), cache_(cache), channel_(channel) {
    times_.queue = job_.queue_ms;
  }

  Finished run() {
    std::string document_hash;
    if (channel_ != nullptr) document_hash = tracer::sha256_hex(job_.document);
    tracer::Scene scene = parse();
    const auto compiled = compile(scene);
    if (channel_ != nullptr) start_exchange(std::move(document_hash));
    control_.display_output.exposure = scene.output.exposure;
    control_.display_output.overflow = scene.output.overflow;
    tracer::Rendered rendered = trace(*compiled);
    Finished finished{job_.job_id, job_.fence, {}, encode(rendered, scene.output)};
    finished.report =
        api::write_report(scene, rendered.error, artifacts_, rendered.statistics, times_, memory_bytes_, division());
    return finished;
  }

  std::shared_ptr<const tracer::CompiledScene> compiled() {
    tracer::Scene scene = parse();
    return compile(scene);
  }

 private:
  void start_exchange(std::string document_hash) {
    const std::lock_guard lock(control_.exchange_mutex);
    control_.exchange = std::make_shared<TaskExchange>(
        TaskExchangeSettings{job_.job_id, std::move(document_hash), channel_->threads, times_.build, job_.resumes},
        channel_->helpers, control_.tracing, channel_->send);
  }

  [[nodiscard]] api::Division division() const {
    const TaskExchange* const exchange = control_.exchange.get();
    if (exchange == nullptr || exchange->tasks() == 0) return {};
    return {exchange->workers(), exchange->tasks(), exchange->repeated()};
  }

  tracer::Scene parse() {
    auto document = api::parse_scene(job_.document, reading_limits(files_.settings));
    if (!document) stop_for(document.error());
    if (cache_ != nullptr && document->scene.accuracy.uses_patches())
      everything_but_the_view_ = digest_without_view(job_.document, reading_limits(files_.settings));
    job_.document = std::string();  // it may be large
    times_.parse = watch_.lap();
    return std::move(document->scene);
  }

  /// Frees the bytes of files and the meshes of `scene`.
  std::shared_ptr<const tracer::CompiledScene> compile(tracer::Scene& scene) {
    stop_if_cancelled(control_.tracing);
    std::shared_ptr<tracer::SceneCacheEntry> entry;
    if (cache_ != nullptr)
      entry =
          value_of(cache_->acquire(scene, content_names(scene, files_), control_.tracing, everything_but_the_view_));
    const tracer::Assets assets = load_files(scene, files_, control_.tracing);
    times_.parse += watch_.lap();
    auto compiled = value_of(
        tracer::compile_taking_meshes(scene, control_.tracing, assets, entry.get(), [&] { return watch_.elapsed(); }));
    times_.build = watch_.lap();
    times_.cache_hits = tracer::cache_hits(*compiled);
    times_.radiosity = tracer::radiosity_figures(*compiled);
    return compiled;
  }

  tracer::Rendered trace(const tracer::CompiledScene& compiled) {
    // A time budget includes compilation and tracing.
    const auto elapsed_ms = [&] { return times_.build + watch_.elapsed(); };
    tracer::Rendered rendered = value_of(tracer::render(
        compiled, {.elapsed_ms = elapsed_ms, .preview = &control_.preview, .exchange = control_.exchange.get()},
        control_.tracing));
    times_.trace = watch_.lap();
    memory_bytes_ = tracer::memory_bytes(compiled) + rendered.image.rgb.size() * sizeof(float);
    return rendered;
  }

  std::vector<Image> encode(const tracer::Rendered& rendered, const tracer::Output& output) {
    std::vector<Image> images;
    for (const tracer::Format format : output.formats) {
      stop_if_cancelled(control_.tracing);
      const auto encoded = tracer::encode(rendered.image, format, output);
      if (!encoded) throw Stop{queue::Problem{"internal", encoded.error(), {}}};
      memory_bytes_ += encoded->bytes.size();
      const std::string_view bytes(reinterpret_cast<const char*>(encoded->bytes.data()), encoded->bytes.size());
      const std::string name = "image." + std::string(tracer::extension(format));
      images.push_back({name, std::string(tracer::media_type(format)), sealed_memory(bytes)});
      artifacts_.push_back({name, tracer::file_error(rendered.error, encoded->error)});
    }
    times_.encode = watch_.lap();
    return images;
  }

  Assign job_;
  const JobFiles& files_;
  JobControl& control_;
  tracer::SceneCache* cache_;
  std::string everything_but_the_view_;  ///< empty for a scene without patches
  const TaskChannel* channel_;
  Stopwatch watch_;
  api::StageTimes times_;
  std::vector<api::ReportedArtifact> artifacts_;
  std::uint64_t memory_bytes_ = 0;  ///< size of the compiled scene, the image and the encoded files
};

// ---- measurements

double steady_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// Linear, as the images of which it is the mean.
std::vector<std::uint8_t> reference_exr(const tracer::Reference& reference) {
  auto exr = tracer::encode(tracer::mean_image(reference), tracer::Format::exr);
  if (!exr) throw Stop{queue::Problem{"internal", exr.error(), {}}};
  return std::move(exr->bytes);
}

std::vector<Image> images_of(const tracer::Measurement& measurement, const tracer::Reference& reference,
                             const std::string& job_id) {
  const tracer::Plot plot = tracer::chart(measurement);
  const auto png = tracer::plot_png(plot);
  if (!png) throw Stop{queue::Problem{"internal", png.error(), {}}};
  const std::string_view png_bytes(reinterpret_cast<const char*>(png->data()), png->size());
  const std::string json = api::write_measurement(measurement, {job_id, true});
  const std::string csv = api::write_measurement_csv(measurement), svg = tracer::plot_svg(plot);
  const std::vector<std::uint8_t> exr = reference_exr(reference);
  const std::string_view exr_bytes(reinterpret_cast<const char*>(exr.data()), exr.size());
  const std::string_view contents[] = {json, csv, svg, png_bytes, exr_bytes};
  std::vector<Image> images;
  for (std::size_t i = 0; i < std::size(contents); ++i)
    images.push_back({measurement_files[i].name, measurement_files[i].media_type, sealed_memory(contents[i])});
  return images;
}

tracer::Measurement run_to_end(tracer::MeasurementRun& run, JobControl& control) {
  control.steps_total = run.steps();
  while (!run.done()) {
    if (const auto failure = run.step(control.tracing)) stop_for(*failure);
    control.steps_done = run.steps_done();
    const tracer::Measurement so_far = run.measurement();
    if (so_far.points.empty()) continue;
    const std::lock_guard lock(control.measured_mutex);
    control.measured = api::write_measurement_summary(so_far, control.alone);
  }
  return run.measurement();
}

Finished measure(const Assign& job, const JobFiles& files, JobControl& control) {
  auto request = api::parse_measure(job.document, reading_limits(files.settings));
  if (!request) stop_for(request.error());
  tracer::Scene& scene = request->document.scene;
  const tracer::Assets assets = load_files(scene, files, control.tracing);
  if (tracer::settings(scene, request->parameters).empty()) {
    throw Stop{queue::Problem{
        "bad_scene",
        "There is nothing to measure.",
        {{"/settings/parameters", "out_of_range", "none of these parameters changes anything in this scene"}}}};
  }
  tracer::MeasurementRun run(
      scene, assets,
      {.parameters = request->parameters, .reference_samples = request->reference_samples, .seconds = steady_seconds});
  const tracer::Measurement measurement = run_to_end(run, control);
  return {job.job_id, job.fence, api::write_measurement_summary(measurement, control.alone),
          images_of(measurement, run.reference(), job.job_id)};
}

}  // namespace

Outcome render_job(Assign job, const JobFiles& files, JobControl& control, tracer::SceneCache* cache,
                   const TaskChannel* channel) noexcept {
  const std::string id = job.job_id;
  const std::int64_t fence = job.fence;
  return outcome_of(id, fence, [&] { return RenderStages(std::move(job), files, control, cache, channel).run(); });
}

std::shared_ptr<const tracer::CompiledScene> compile_document(const std::string& document, const JobFiles& files,
                                                              JobControl& control, tracer::SceneCache* cache) noexcept {
  std::shared_ptr<const tracer::CompiledScene> compiled;
  outcome_of({}, 0, [&] {
    compiled = RenderStages({.job_id = {}, .document = document}, files, control, cache, nullptr).compiled();
    return Finished{};
  });
  return compiled;
}

Outcome measure_job(const Assign& job, const JobFiles& files, JobControl& control) noexcept {
  return outcome_of(job.job_id, job.fence, [&] { return measure(job, files, control); });
}

bool load_encoders() {
  const tracer::Image pixel{.width = 1, .height = 1, .rgb = {0, 0, 0}};
  oneapi::tbb::task_arena arena(1);
  const auto encoded = arena.execute([&] { return tracer::encode(pixel, tracer::Format::exr); });
  if (!encoded) std::fprintf(stderr, "whittled-worker: %s\n", encoded.error().c_str());
  return encoded.has_value();
}

bool load_fonts() { return tracer::plot_png(tracer::chart({})).has_value(); }

}  // namespace worker
