#include <oneapi/tbb/global_control.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <optional>
#include <string>
#include <utility>

#include "tracer/cli/load_scene.h"
#include "tracer/cli/measure_files.h"
#include "tracer/cli/messages.h"
#include "tracer/cli/progress.h"
#include "tracer/limits.h"
#include "tracer/measure.h"
#include "tracer/validate.h"

namespace cli {
namespace {

double steady_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// Changes the size; a crop keeps its relative position.
void resize(tracer::ImageSize& image, std::uint32_t width, std::uint32_t height) {
  if (image.crop) {
    tracer::PixelWindow& crop = *image.crop;
    const double wider = static_cast<double>(width) / image.width, higher = static_cast<double>(height) / image.height;
    crop.x0 = std::min(static_cast<std::uint32_t>(crop.x0 * wider), width - 1);
    crop.y0 = std::min(static_cast<std::uint32_t>(crop.y0 * higher), height - 1);
    crop.x1 = std::clamp(static_cast<std::uint32_t>(std::ceil(crop.x1 * wider)), crop.x0 + 1, width);
    crop.y1 = std::clamp(static_cast<std::uint32_t>(std::ceil(crop.y1 * higher)), crop.y0 + 1, height);
  }
  image.width = width;
  image.height = height;
}

void resize(tracer::ImageSize& image, const MeasureOptions& options) {
  if (options.size) resize(image, options.size->first, options.size->second);
  if (!options.scale) return;
  const auto scaled = [&](std::uint32_t side) {
    return static_cast<std::uint32_t>(std::max(1.0, std::round(side * *options.scale)));
  };
  resize(image, scaled(image.width), scaled(image.height));
}

/// Takes one step and saves its result. Returns an exit code on failure only.
std::optional<ExitCode> take_step(tracer::MeasurementRun& run, const MeasureOptions& options, const std::string& key,
                                  tracer::RenderControl& control) {
  const std::uint32_t images = run.reference().images;
  const bool was_complete = run.reference().complete;
  std::optional<tracer::Failure> failure;
  {
    const std::string label = std::to_string(run.steps_done() + 1) + "/" + std::to_string(run.steps());
    const ProgressBar bar(control, !options.quiet, label + " " + run.next());
    failure = run.step(control);
  }
  const tracer::Reference& reference = run.reference();
  if (reference.images != images || reference.complete != was_complete)
    if (const auto written = write_reference(options.name, key, reference); !written)
      return fail(written.error().message);
  if (failure) return fail(*failure, "interrupted; rerun the command to resume from " + options.name + ".json");
  if (const auto written = write_points(options.name, key, run.measurement(), run.done()); !written)
    return fail(written.error().message);
  return std::nullopt;
}

/// The reference, one line per point (* on the Pareto front) and the advice.
void print_table(const tracer::Measurement& measurement) {
  std::printf("image      %u x %u\n", measurement.width, measurement.height);
  std::printf("reference  %u samples per pixel, standard error %.4f levels\n", measurement.reference_samples,
              measurement.reference_error);
  std::printf("\n  %-34s %9s %9s %9s %9s\n", "setting (* Pareto front)", "seconds", "error", "claimed", "samples");
  const std::vector<std::size_t> front = tracer::pareto_front(measurement.points);
  for (std::size_t i = 0; i < measurement.points.size(); ++i) {
    const tracer::MeasuredPoint& point = measurement.points[i];
    const bool in_front = std::find(front.begin(), front.end(), i) != front.end();
    std::printf("%c %-34s %9.4f %9.4f %9.4f %9.2f\n", in_front ? '*' : ' ', title(point.setting).c_str(), point.seconds,
                point.error, point.claimed.estimate, point.samples_mean);
  }
  std::puts("");
  for (const std::string& sentence : tracer::advice(measurement)) std::printf("- %s\n", sentence.c_str());
}

/// Takes all remaining steps, resuming from saved files, and writes the results.
ExitCode measure_all(tracer::MeasurementRun& run, const MeasureOptions& options, const std::string& key) {
  auto saved = read_saved_measurement(options.name, key);
  if (!saved) return fail(saved.error().message);
  if (saved->has_other_key && !options.quiet)
    std::fprintf(stderr, "%s.json has another scene, size or build: starting again\n", options.name.c_str());
  if (saved->reference) run.resume(*std::move(saved->reference));
  if (run.reference().complete) run.resume(std::move(saved->points));  // points are valid for their reference only
  tracer::RenderControl control;
  const CancelOnSignal cancel_on_signal(control);
  while (!run.done())
    if (const auto stopped = take_step(run, options, key, control)) return *stopped;
  const tracer::Measurement measurement = run.measurement();
  if (const auto written = write_points(options.name, key, measurement, true); !written)
    return fail(written.error().message);
  if (const auto written = write_results(options.name, measurement); !written) return fail(written.error().message);
  if (options.quiet) return success;
  print_table(measurement);
  return std::fflush(stdout) == 0 ? success : environment_failure;
}

}  // namespace

ExitCode run(const MeasureOptions& options) {
  const auto text = read_document(options.scene);
  if (!text) return fail(text.error().message);
  auto loaded = load_scene(*text, options.scene);
  if (!loaded) {
    print_issues(stderr, loaded.error());
    return invalid_scene;
  }
  tracer::Scene& scene = loaded->document.scene;
  resize(scene.image, options);
  const std::vector<tracer::Issue> issues = tracer::validate(scene, tracer::Limits());  // of the new size
  for (const tracer::Issue& issue : issues) print_issue(stderr, issue);
  if (!issues.empty()) return invalid_scene;

  // --threads bounds the thread pool that scene building uses.
  std::optional<tbb::global_control> bound;
  if (options.threads != 0) bound.emplace(tbb::global_control::max_allowed_parallelism, options.threads);
  tracer::MeasurementRun run(scene, loaded->assets,
                             {.parameters = options.parameters,
                              .reference_samples = options.reference_samples,
                              .threads = options.threads,
                              .seconds = steady_seconds});
  return measure_all(run, options, fingerprint(*text, loaded->assets, options));
}

}  // namespace cli
