#include <oneapi/tbb/global_control.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <optional>
#include <string>
#include <utility>

#include "api/document.h"
#include "tracer/cli/asset_directory_files.h"
#include "tracer/cli/commands.h"
#include "tracer/cli/files.h"
#include "tracer/cli/issues.h"
#include "tracer/cli/measure_files.h"
#include "tracer/cli/measure_table.h"
#include "tracer/cli/progress.h"
#include "tracer/limits.h"
#include "tracer/measure.h"
#include "tracer/validate.h"

namespace cli {
namespace {

ExitCode complain(const std::string& sentence, ExitCode code = bad_environment) {
  std::fprintf(stderr, "whittle: %s\n", sentence.c_str());
  return code;
}

ExitCode complain(const tracer::Failure& failure, const std::string& name) {
  if (failure.code == tracer::Failure::Code::cancelled)
    return complain("interrupted; the same command goes on from " + name + ".json", interrupted);
  if (failure.code == tracer::Failure::Code::bad_asset) {
    print_issue(stderr, {failure.pointer, "bad_asset", failure.detail});
    return bad_scene;
  }
  return complain(failure.detail);
}

double steady_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// The same image with other pixels; a crop is that part of it that it was.
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

/// One step, and what it came to, on the disk. Nothing when all went well.
std::optional<ExitCode> take_step(tracer::MeasurementRun& measuring, const MeasureOptions& options,
                                  const std::string& key, tracer::RenderControl& control) {
  const std::uint32_t images = measuring.reference().images;
  const bool was_complete = measuring.reference().complete;
  std::optional<tracer::Failure> failure;
  {
    const std::string label = std::to_string(measuring.steps_done() + 1) + "/" + std::to_string(measuring.steps());
    const ProgressBar bar(control, !options.quiet, label + " " + measuring.next());
    failure = measuring.step(control);
  }
  const tracer::Reference& reference = measuring.reference();
  if (reference.images != images || reference.complete != was_complete)
    if (const auto written = write_reference(options.name, key, reference); !written)
      return complain(written.error().sentence);
  if (failure) return complain(*failure, options.name);
  if (const auto written = write_points(options.name, key, measuring.measurement(), measuring.done()); !written)
    return complain(written.error().sentence);
  return std::nullopt;
}

/// To the end, from what earlier runs left.
ExitCode measure_all(tracer::MeasurementRun& measuring, const MeasureOptions& options, const std::string& key) {
  auto earlier = read_earlier(options.name, key);
  if (!earlier) return complain(earlier.error().sentence);
  if (earlier->is_other && !options.quiet)
    std::fprintf(stderr, "%s.json is of another scene, size or build: starting over\n", options.name.c_str());
  if (earlier->reference) measuring.resume(*std::move(earlier->reference));
  if (measuring.reference().complete) measuring.resume(std::move(earlier->points));  // they were compared with it
  tracer::RenderControl control;
  const CancelOnSignal cancel_on_signal(control);
  while (!measuring.done())
    if (const auto stopped = take_step(measuring, options, key, control)) return *stopped;
  const tracer::Measurement measurement = measuring.measurement();
  if (const auto written = write_points(options.name, key, measurement, true); !written)
    return complain(written.error().sentence);
  if (const auto written = write_results(options.name, measurement); !written)
    return complain(written.error().sentence);
  if (options.quiet) return done;
  print_table(stdout, measurement);
  return std::fflush(stdout) == 0 ? done : bad_environment;
}

}  // namespace

ExitCode measure(const MeasureOptions& options) {
  const auto bytes = read_all(options.scene_path, api::DocumentLimits{}.bytes);
  if (!bytes) return complain(bytes.error().sentence);
  auto loaded = load(*bytes, options.scene_path, options.uploads_directory);
  if (!loaded) {
    print_issues(stderr, loaded.error());
    return bad_scene;
  }
  tracer::Scene& scene = loaded->document.scene;
  resize(scene.image, options);
  const std::vector<tracer::Issue> issues = tracer::validate(scene, tracer::Limits());  // of the size, if any
  for (const tracer::Issue& issue : issues) print_issue(stderr, issue);
  if (!issues.empty()) return bad_scene;

  // The scene's build uses whatever pool there is; this bounds it as --threads says.
  std::optional<tbb::global_control> bound;
  if (options.threads != 0) bound.emplace(tbb::global_control::max_allowed_parallelism, options.threads);
  tracer::MeasurementRun measuring(scene, loaded->assets,
                                   {.knobs = options.knobs,
                                    .reference_samples = options.reference_samples,
                                    .threads = options.threads,
                                    .seconds = steady_seconds});
  return measure_all(measuring, options, fingerprint(*bytes, loaded->assets, options));
}

}  // namespace cli
