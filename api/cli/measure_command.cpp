#include <oneapi/tbb/global_control.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "api/cli/files.h"
#include "api/cli/messages.h"
#include "api/cli/options.h"
#include "api/cli/progress.h"
#include "api/measurement_json.h"
#include "tracer/limits.h"
#include "tracer/measure.h"
#include "tracer/plot.h"
#include "tracer/scene.h"
#include "tracer/sha256.h"
#include "tracer/validate.h"
#include "tracer/version.h"

namespace cli {
namespace {

constexpr std::size_t json_bytes_max = 64u << 20;
constexpr std::string_view signature = "whittle-reference-1";
constexpr std::size_t header_bytes_max = 256;

std::span<const std::uint8_t> bytes_of(std::string_view text) {
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

std::size_t array_bytes(const tracer::Reference& reference) {
  return 3 * sizeof(double) * std::size_t{reference.width} * reference.height;
}

std::string header_of(const tracer::Reference& reference, const std::string& key) {
  std::ostringstream header;
  header << signature << ' ' << key << ' ' << reference.width << ' ' << reference.height << ' '
         << reference.image_samples << ' ' << reference.images << ' ' << reference.complete << '\n';
  return std::move(header).str();
}

/// The file of a reference: that of the scene's model or of the other one.
std::string reference_path(const std::string& name, std::size_t index) {
  return name + (index == 0 ? ".reference" : ".model-reference");
}

/// Returns nothing for a file that is invalid, truncated or of another key; the reference is then computed again.
std::optional<tracer::Reference> parse_reference(std::string_view bytes, const std::string& key) {
  const std::size_t end = bytes.substr(0, header_bytes_max).find('\n');
  if (end == std::string_view::npos) return std::nullopt;
  std::istringstream header{std::string(bytes.substr(0, end))};
  std::string seen_signature, seen_key;
  tracer::Reference reference;
  header >> seen_signature >> seen_key >> reference.width >> reference.height >> reference.image_samples >>
      reference.images >> reference.complete;
  bytes.remove_prefix(end + 1);
  const std::size_t size = array_bytes(reference);
  if (!header || seen_signature != signature || seen_key != key || bytes.size() != 2 * size || size == 0)
    return std::nullopt;
  for (std::vector<double>* sums : {&reference.radiance_sum, &reference.squared_sum}) {
    sums->resize(size / sizeof(double));
    std::memcpy(sums->data(), bytes.data(), size);
    bytes.remove_prefix(size);
  }
  return reference;
}

/// SHA-256 of document, assets, build and every option that changes the result of a point, including the number of
/// threads, in hexadecimal.
std::string fingerprint(std::string_view document, const tracer::Assets& assets, const MeasureOptions& options) {
  const auto [width, height] = options.size.value_or(std::pair(0u, 0u));
  std::ostringstream inputs;
  inputs << tracer::build() << ' ' << width << ' ' << height << ' ' << std::hexfloat << options.scale.value_or(0) << ' '
         << options.reference_samples << ' ' << options.threads << ' ' << tracer::sha256_hex(document);
  for (const std::vector<std::uint8_t>& bytes : assets.bytes)
    inputs << ' ' << tracer::sha256_hex({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  return tracer::sha256_hex(inputs.str());
}

/// State of an interrupted run.
struct SavedMeasurement {
  std::vector<tracer::MeasuredPoint> points;
  std::vector<std::optional<tracer::Reference>> references;
  bool has_other_key = false;  ///< one exists for another scene, size or build; it will be replaced
};

/// Reads `name`.json and the files of `count` references. Fails if one of them exists and cannot be read, or if
/// `name`.json is not a measurement, so that no other file is overwritten.
SavedMeasurement read_saved_measurement(const std::string& name, const std::string& key, std::size_t count) {
  SavedMeasurement saved;
  const std::string json_path = name + ".json";
  std::error_code ignored;
  if (std::filesystem::exists(json_path, ignored)) {
    auto measurement = api::read_measurement(read_text(json_path, json_bytes_max));
    if (!measurement)
      throw std::runtime_error(json_path + " exists and is not a measurement of this version; choose another -o");
    if (measurement->info.key == key) {
      saved.points = std::move(measurement->points);
    } else {
      saved.has_other_key = true;
    }
  }
  for (std::size_t index = 0; index < count; ++index) {
    const std::string path = reference_path(name, index);
    if (!std::filesystem::exists(path, ignored)) continue;
    saved.references.resize(index + 1);
    saved.references[index] =
        parse_reference(read_text(path, 6 * sizeof(double) * tracer::Limits().pixels + header_bytes_max), key);
  }
  return saved;
}

/// Writes the file of a reference: one line of text, then the sums as doubles in native byte order.
void write_reference(const std::string& path, const std::string& key, const tracer::Reference& reference) {
  std::string bytes = header_of(reference, key);
  for (const std::vector<double>* sums : {&reference.radiance_sum, &reference.squared_sum})
    bytes.append(reinterpret_cast<const char*>(sums->data()), sums->size() * sizeof(double));
  write_file(path, bytes_of(bytes));
}

/// Writes `name`.json.
void write_points(const std::string& name, const std::string& key, const tracer::Measurement& measurement,
                  bool complete) {
  write_file(name + ".json", bytes_of(api::write_measurement(measurement, {key, complete})));
}

/// Writes `name`.csv, .svg and .png: all or none.
void write_results(const std::string& name, const tracer::Measurement& measurement) {
  const tracer::Plot plot = tracer::chart(measurement);
  const auto png = tracer::plot_png(plot);
  if (!png) throw std::runtime_error(png.error());
  const std::array<std::pair<const char*, std::string>, 3> contents{{{".csv", api::write_measurement_csv(measurement)},
                                                                     {".svg", tracer::plot_svg(plot)},
                                                                     {".png", std::string(png->begin(), png->end())}}};
  std::vector<PendingFile> files;
  for (const auto& [ending, bytes] : contents) files.emplace_back(name + ending).write(bytes_of(bytes));
  for (PendingFile& file : files) file.publish();
}

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
  std::vector<std::pair<std::uint32_t, bool>> before;
  for (const tracer::Reference& each : run.references()) before.emplace_back(each.images, each.complete);
  std::optional<tracer::Failure> failure;
  {
    const std::string label = std::to_string(run.steps_done() + 1) + "/" + std::to_string(run.steps());
    const ProgressBar bar(control, !options.quiet, label + " " + run.next());
    failure = run.step(control);
  }
  for (std::size_t i = 0; i < run.references().size(); ++i) {
    const tracer::Reference& reference = run.references()[i];
    if (std::pair(reference.images, reference.complete) != before[i])
      write_reference(reference_path(options.name, i), key, reference);
  }
  if (failure) return fail(*failure, "interrupted; rerun the command to resume from " + options.name + ".json");
  write_points(options.name, key, run.measurement(), run.done());
  return std::nullopt;
}

/// One line of the table: * is on the Pareto front, ! has a broken claim, and is red on a terminal, <= is an upper
/// limit.
void print_point(const tracer::MeasuredPoint& point, char mark) {
  const bool red = mark == '!' && ::isatty(STDOUT_FILENO) != 0;
  const auto print_error = [&](const char* name, double error) {
    std::printf(is_upper_limit(point, name) ? " <=%7.4f" : " %9.4f", error);
  };
  std::printf("%s%c %-37s %9.4f", red ? "\x1b[31m" : "", mark, title(point.setting).c_str(), point.seconds);
  print_error("error", point.error);
  std::printf(" %9.4f %9.2f", point.claimed.estimate, point.samples_mean);
  if (point.setting.model == "path") {
    std::printf(" %9d", 0);  // its model is the rendering equation
  } else if (point.model_error) {
    print_error("model_error", *point.model_error);
  }
  if (point.total_error) print_error("total_error", *point.total_error);
  std::puts(red ? "\x1b[0m" : "");
}

/// The reference, one line per point, and the advice.
void print_table(const tracer::Measurement& measurement) {
  std::printf("image      %u x %u\n", measurement.width, measurement.height);
  std::printf("reference  %u samples per pixel, standard error %.4f levels\n", measurement.reference_samples,
              measurement.reference_error);
  std::printf("* fastest with at most its claimed error    ! true error above the claimed one\n");
  std::printf("<= at most: the reference shows no smaller error\n\n");
  std::printf("  %-37s %9s %9s %9s %9s%s\n", "setting", "seconds", "error", "claimed", "samples",
              measurement.model_error ? "     model     total" : "");
  std::vector<std::size_t> front = tracer::pareto_front(measurement);
  for (const std::string_view model : tracer::light_models)
    for (const std::size_t index : tracer::model_front(measurement, model)) front.push_back(index);
  for (std::size_t i = 0; i < measurement.points.size(); ++i) {
    const tracer::MeasuredPoint& point = measurement.points[i];
    const bool in_front = std::ranges::find(front, i) != front.end();
    print_point(point, in_front ? '*' : tracer::is_broken(measurement, point) ? '!' : ' ');
  }
  if (measurement.not_measured)
    std::printf("  model, rendering equation             not measured: %s\n", measurement.not_measured->c_str());
  std::puts("");
  for (const std::string& sentence : tracer::advice(measurement)) std::printf("- %s\n", sentence.c_str());
}

/// Takes all remaining steps, resuming from saved files, and writes the results.
ExitCode measure_all(tracer::MeasurementRun& run, const MeasureOptions& options, const std::string& key) {
  SavedMeasurement saved = read_saved_measurement(options.name, key, run.references().size());
  if (saved.has_other_key)
    std::fprintf(stderr, "%s.json has another scene, size or build: starting again\n", options.name.c_str());
  for (std::size_t i = 0; i < saved.references.size(); ++i) {
    if (!saved.references[i]) continue;
    saved.references[i]->model = run.references()[i].model;
    run.resume(*std::move(saved.references[i]));
  }
  run.resume(std::move(saved.points));
  tracer::RenderControl control;
  const CancelOnSignal cancel_on_signal(control);
  while (!run.done())
    if (const auto stopped = take_step(run, options, key, control)) return *stopped;
  const tracer::Measurement measurement = run.measurement();
  write_points(options.name, key, measurement, true);
  write_results(options.name, measurement);
  print_table(measurement);
  return std::fflush(stdout) == 0 ? success : environment_failure;
}

}  // namespace

ExitCode run(const MeasureOptions& options) {
  const std::string text = read_document(options.scene);
  api::DocumentRender render;
  if (const auto loaded = load_scene(render, text, options.scene); !loaded) {
    print_issues(stderr, loaded.error());
    return invalid_scene;
  }
  tracer::Scene& scene = render.document.scene;
  resize(scene.image, options);
  const std::vector<tracer::Issue> issues = tracer::validate(scene, tracer::Limits());  // of the new size
  for (const tracer::Issue& issue : issues) print_issue(stderr, issue);
  if (!issues.empty()) return invalid_scene;

  // --threads bounds the thread pool that scene building uses.
  std::optional<tbb::global_control> bound;
  if (options.threads != 0) bound.emplace(tbb::global_control::max_allowed_parallelism, options.threads);
  tracer::MeasurementRun run(scene, render.assets,
                             {.parameters = options.parameters,
                              .reference_samples = options.reference_samples,
                              .threads = options.threads,
                              .seconds = steady_seconds});
  return measure_all(run, options, fingerprint(text, render.assets, options));
}

}  // namespace cli
