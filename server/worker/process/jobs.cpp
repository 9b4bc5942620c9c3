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

#include "api/import_model.h"
#include "api/measure_request.h"
#include "api/measurement_json.h"
#include "api/render_document.h"
#include "api/report.h"
#include "server/worker/process/task_exchange.h"
#include "tracer/encode.h"
#include "tracer/live.h"
#include "tracer/measure.h"
#include "tracer/plot.h"
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

/// Leaves the stage if the job is cancelled.
void stop_if_cancelled(const tracer::RenderControl& control) {
  if (control.cancelled()) throw Stop{};
}

[[noreturn]] void stop_for(std::string failure) { throw Stop{queue::Problem{"internal", std::move(failure), {}}}; }

[[noreturn]] void stop_for(std::vector<tracer::Issue> of_files) {
  throw Stop{queue::Problem{"bad_asset", "The scene cannot be rendered with its files.", std::move(of_files)}};
}

/// Stops with the problem "bad_scene".
[[noreturn]] void stop_for(const api::Refusal& refusal) {
  const std::string detail =
      refusal.detail.empty() ? "The scene has " + std::to_string(refusal.issues.size()) + " errors." : refusal.detail;
  throw Stop{queue::Problem{"bad_scene", detail, refusal.issues}};
}

[[noreturn]] void stop_for(const tracer::Failure& failure) {
  using Code = tracer::Failure::Code;
  if (failure.code == Code::cancelled) throw Stop{};
  if (failure.code == Code::bad_asset)
    stop_for(std::vector<tracer::Issue>{{failure.pointer, "bad_asset", failure.detail}});
  const char* const code = failure.code == Code::out_of_memory ? "out_of_memory" : "internal";
  throw Stop{queue::Problem{code, failure.detail, {}}};
}

template <class T, class Reason>
T value_of(tracer::Result<T, Reason> result) {
  if (!result) stop_for(std::move(result.error()));
  return *std::move(result);
}

/// No limits on the document: they were checked when it was accepted, and may have changed since.
api::Limits reading_limits(const FileSettings& files) {
  api::Limits limits = no_limits();
  if (!files.directory.empty()) limits.files = api::Files::below_a_directory;
  limits.uploads = !files.uploads.empty();
  return limits;
}

/// Limits of scenes with mesh files, all objects included.
tracer::Limits loading_limits(const FileSettings& files) {
  tracer::Limits limits = no_limits().scene;
  limits.objects = files.objects;
  limits.triangles = files.triangles;
  return limits;
}

/// Reads a file of a scene; stops between files if the job is cancelled.
api::ReadAsset reader_of(const JobFiles& files, const tracer::RenderControl& control) {
  return [&](const std::string& name) {
    stop_if_cancelled(control);
    return files.client->read(name);
  };
}

std::string_view text_of(const std::vector<std::uint8_t>& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

// ---- renders

/// Parses, loads and compiles a document. `change`: applied to its scene before it is compiled.
void compile(api::DocumentRender& render, std::string document, const JobFiles& files, tracer::RenderControl& control,
             tracer::SceneCache* cache, const std::function<void(tracer::Scene&)>& change = {}) {
  value_of(render.parse(document, reading_limits(files.settings)));
  value_of(render.import(reader_of(files, control), reading_limits(files.settings)));
  if (change) change(render.document.scene);
  document = std::string();  // it may be large
  stop_if_cancelled(control);
  const auto content_of = [&](const std::string& name) { return files.client->content_name(name); };
  if (cache != nullptr) value_of(render.reuse(*cache, content_of, control));
  value_of(render.load(reader_of(files, control), loading_limits(files.settings)));
  value_of(render.compile(control));
}

Finished render(Assign job, const JobFiles& files, JobControl& control, tracer::SceneCache* cache,
                const TaskChannel* channel) {
  api::DocumentRender render;
  render.times.queue = job.queue_ms;
  std::string document_hash;
  if (channel != nullptr) document_hash = tracer::sha256_hex(job.document);
  compile(render, std::move(job.document), files, control.tracing, cache);
  if (channel != nullptr) {
    const std::lock_guard lock(control.exchange_mutex);
    control.exchange = std::make_shared<TaskExchange>(
        TaskExchangeSettings{job.job_id, std::move(document_hash), channel->threads, render.times.build, job.resumes},
        channel->helpers, control.tracing, channel->send);
  }
  const tracer::Output& output = render.document.scene.output;
  control.display_output.exposure = output.exposure;
  control.display_output.overflow = output.overflow;
  TaskExchange* const exchange = control.exchange.get();
  value_of(render.trace({.preview = &control.preview, .exchange = exchange}, control.tracing));
  Finished finished{job.job_id, job.fence, {}, {}};
  for (const tracer::Format format : output.formats) {
    stop_if_cancelled(control.tracing);
    const std::string name = tracer::file_name(format);
    const std::vector<std::uint8_t> bytes = value_of(render.encode(format, name));
    finished.images.push_back({name, std::string(tracer::row(format).media_type), sealed_memory(text_of(bytes))});
  }
  finished.report = render.report(exchange != nullptr ? exchange->division() : api::Division{});
  return finished;
}

// ---- measurements

double steady_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

std::vector<Image> images_of(const tracer::Measurement& measurement, const tracer::Reference& reference,
                             const std::string& job_id) {
  const tracer::Plot plot = tracer::chart(measurement);
  const std::vector<std::uint8_t> png = value_of(tracer::plot_png(plot));
  const std::string json = api::write_measurement(measurement, {job_id, true});
  const std::string csv = api::write_measurement_csv(measurement), svg = tracer::plot_svg(plot);
  // Linear, as the images of which it is the mean.
  const auto exr = value_of(tracer::encode(tracer::mean_image(reference), tracer::Format::exr)).bytes;
  const std::string_view contents[] = {json, csv, svg, text_of(png), text_of(exr)};
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
  const api::Limits limits = reading_limits(files.settings);
  api::MeasureRequest request = value_of(api::parse_measure(job.document, limits));
  if (request.document.model) {
    const auto imported = value_of(api::import_model(request.document, reader_of(files, control.tracing), limits));
    request.document = value_of(api::parse_scene(imported.text, limits));
  }
  tracer::Scene& scene = request.document.scene;
  const tracer::Assets assets =
      value_of(api::load_assets(scene, reader_of(files, control.tracing), loading_limits(files.settings)));
  if (tracer::settings(scene, request.parameters).empty()) {
    throw Stop{queue::Problem{
        "bad_scene",
        "There is nothing to measure.",
        {{"/settings/parameters", "out_of_range", "none of these parameters changes anything in this scene"}}}};
  }
  tracer::MeasurementRun run(
      scene, assets,
      {.parameters = request.parameters, .reference_samples = request.reference_samples, .seconds = steady_seconds});
  const tracer::Measurement measurement = run_to_end(run, control);
  return {job.job_id, job.fence, api::write_measurement_summary(measurement, control.alone),
          images_of(measurement, run.reference(), job.job_id)};
}

}  // namespace

Outcome render_job(Assign job, const JobFiles& files, JobControl& control, tracer::SceneCache* cache,
                   const TaskChannel* channel) noexcept {
  const std::string id = job.job_id;
  const std::int64_t fence = job.fence;
  return outcome_of(id, fence, [&] { return render(std::move(job), files, control, cache, channel); });
}

std::shared_ptr<const tracer::CompiledScene> compile_document(const std::string& document, const JobFiles& files,
                                                              tracer::SceneCache* cache) noexcept {
  tracer::RenderControl control;
  api::DocumentRender render;
  outcome_of({}, 0, [&] {
    compile(render, document, files, control, cache);
    return Finished{};
  });
  return std::move(render.compiled);
}

queue::ImageTaskResult live_form(std::string document, const JobFiles& files, tracer::SceneCache* cache) noexcept {
  queue::ImageTaskResult result;
  const Outcome outcome = outcome_of({}, 0, [&] {
    tracer::RenderControl control;
    api::DocumentRender render;
    std::vector<tracer::LiveOmission> omitted;
    compile(render, std::move(document), files, control, cache,
            [&](tracer::Scene& scene) { omitted = tracer::leave_out(scene); });
    const auto live = tracer::live_scene(render.document.scene, *render.compiled);
    if (!live) throw Stop{queue::Problem{"bad_scene", live.error(), {}}};
    result.bytes = api::write_live(render.document.scene, *live, omitted);
    return Finished{};
  });
  if (const auto* failed = std::get_if<Failed>(&outcome)) {
    const auto& [code, detail, errors] = failed->problem;
    result.failure = errors.empty() ? detail : errors.front().pointer + ": " + errors.front().detail;
    if (code == "bad_scene" || code == "bad_asset") result.code = queue::bad_scene;
  }
  return result;
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
