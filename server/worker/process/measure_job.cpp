#include <chrono>
#include <string_view>
#include <utility>
#include <vector>

#include "api/measure_request.h"
#include "api/measurement_json.h"
#include "server/worker/process/jobs.h"
#include "tracer/measure.h"
#include "tracer/plot.h"

namespace worker {
namespace {

double steady_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

Image image(const char* name, const char* media_type, std::string_view bytes) {
  return {name, media_type, sealed_memory(bytes)};
}

std::vector<Image> images_of(const tracer::Measurement& measurement, const std::string& job_id) {
  const tracer::Plot plot = tracer::chart(measurement);
  const auto png = tracer::plot_png(plot);
  if (!png) throw Stop{queue::Problem{"internal", png.error(), {}}};
  const std::string_view png_bytes(reinterpret_cast<const char*>(png->data()), png->size());
  std::vector<Image> images;
  images.push_back(image("measure.json", "application/json", api::write_measurement(measurement, {job_id, true})));
  images.push_back(image("measure.csv", "text/csv", api::write_measurement_csv(measurement)));
  images.push_back(image("measure.svg", "image/svg+xml", tracer::plot_svg(plot)));
  images.push_back(image("measure.png", "image/png", png_bytes));
  return images;
}

tracer::Measurement run_to_end(tracer::MeasurementRun& run, JobControl& control) {
  control.steps_total = run.steps();
  while (!run.done()) {
    if (const auto failure = run.step(control.tracing)) stop_for(*failure);
    control.steps_done = run.steps_done();
  }
  return run.measurement();
}

Finished measure(const Assign& job, const FileSettings& files, JobControl& control) {
  auto request = api::parse_measure(job.document, reading_limits(files));
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
          images_of(measurement, job.job_id)};
}

}  // namespace

Outcome measure_job(const Assign& job, const FileSettings& files, JobControl& control) noexcept {
  return outcome_of(job.job_id, job.fence, [&] { return measure(job, files, control); });
}

bool load_fonts() { return tracer::plot_png(tracer::chart({})).has_value(); }

}  // namespace worker
