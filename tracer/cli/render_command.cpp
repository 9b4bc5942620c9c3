#include <oneapi/tbb/global_control.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cinttypes>
#include <cmath>
#include <cstdio>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "api/report.h"
#include "tracer/cli/files.h"
#include "tracer/cli/messages.h"
#include "tracer/cli/progress.h"
#include "tracer/compile.h"
#include "tracer/encode.h"
#include "tracer/render.h"

namespace cli {
namespace {

using std::chrono::steady_clock;

/// Wall-clock time since the last lap or since construction.
class Stopwatch {
 public:
  [[nodiscard]] double elapsed_ms() const {
    return std::chrono::duration<double, std::milli>(steady_clock::now() - last_).count();
  }
  double lap_ms() {
    const auto now = steady_clock::now();
    return std::chrono::duration<double, std::milli>(now - std::exchange(last_, now)).count();
  }

 private:
  steady_clock::time_point last_ = steady_clock::now();
};

struct RenderSummary {
  struct File {
    std::string path;
    std::size_t bytes = 0;
    tracer::FileError error;
  };
  double parse_ms = 0, build_ms = 0, trace_ms = 0, encode_ms = 0;  ///< wall clock
  std::optional<tracer::RadiosityFigures> radiosity;
  std::uint64_t memory_bytes = 0;  ///< size of the compiled scene and the image
  std::vector<File> files;
};

/// Rates are over the whole trace time, in which all kinds are traced together.
void print_rays(const tracer::RayCounts& rays, double trace_ms) {
  const double seconds = std::max(trace_ms, 1e-3) / 1000;
  const std::array<std::pair<const char*, std::uint64_t>, 6> kinds{{{"camera", rays.camera},
                                                                    {"shadow", rays.shadow},
                                                                    {"reflection", rays.reflection},
                                                                    {"refraction", rays.refraction},
                                                                    {"diffuse", rays.diffuse},
                                                                    {"all", rays.total()}}};
  for (const auto& [kind, count] : kinds)
    std::fprintf(stderr, "%-10s %14" PRIu64 " rays %9.2f million/s\n", kind, count,
                 static_cast<double>(count) / seconds / 1e6);
}

/// The bound that is proven, the worst tile and why sampling ended, as far as they are not trivial.
void print_error_details(const tracer::ErrorEstimate& error) {
  if (std::isfinite(error.proven)) {
    std::fprintf(stderr, "proven     at most %.3g levels; %.3g %% of the pixels certified, %" PRIu64 " looks\n",
                 error.proven, 100 * error.certified_share, error.looks);
  }
  if (error.tile_target) {
    std::fprintf(stderr, "worst tile %.3g levels, target %.3g%s\n", error.worst_tile, *error.tile_target,
                 error.worst_tile <= *error.tile_target ? "" : " not reached");
  } else if (error.worst_tile > 0) {
    std::fprintf(stderr, "worst tile %.3g levels\n", error.worst_tile);
  }
  // In the order of ErrorEstimate::Limit.
  constexpr std::array<const char*, 6> reasons{nullptr,
                                               nullptr,
                                               "the time budget is used",
                                               "samples_max is reached everywhere",
                                               "parts that samples cannot lower exceed the target",
                                               "nothing visible is left"};
  if (const char* const reason = reasons[static_cast<std::size_t>(error.limit)]; reason != nullptr)
    std::fprintf(stderr, "ended      %s\n", reason);
}

/// The error estimate, its parts other than sampling, and its details.
void print_error(const tracer::ErrorEstimate& error) {
  std::fprintf(stderr, "error      at most %.3g levels (%.0f %% confidence)", error.estimate, 100 * error.confidence);
  if (error.target)
    std::fprintf(stderr, ", target %.3g%s", *error.target, error.estimate <= *error.target ? "" : " not reached");
  const std::array<std::pair<const char*, double>, 4> parts{
      {{"depth", error.depth}, {"cutoff", error.cutoff}, {"approximation", error.approximation}, {"tone", error.tone}}};
  for (const auto& [part, levels] : parts)
    if (levels >= 5e-4) std::fprintf(stderr, "; %s %.3g", part, levels);
  std::fputs(error.bounded ? "\n" : "; depth and cutoff are estimates, the radiance of this scene has no bound\n",
             stderr);
  print_error_details(error);
}

void print_summary(const tracer::Rendered& rendered, const RenderSummary& summary) {
  const tracer::RenderStatistics& statistics = rendered.statistics;
  std::fprintf(stderr, "image      %" PRIu32 " x %" PRIu32 ", %" PRIu64 " samples\n", rendered.image.width,
               rendered.image.height, statistics.samples);
  print_rays(statistics.rays, summary.trace_ms);
  print_error(rendered.error);
  std::fprintf(stderr, "time       parse %.1f ms, build %.1f ms, trace %.1f ms, encode %.1f ms\n", summary.parse_ms,
               summary.build_ms, summary.trace_ms, summary.encode_ms);
  if (statistics.culled_shadow_rays != 0)
    std::fprintf(stderr, "culled     %" PRIu64 " shadow rays of negligible lights\n", statistics.culled_shadow_rays);
  if (statistics.duplicates != 0)
    std::fprintf(stderr, "duplicates %" PRIu64 " shapes or triangles equal earlier ones and are left out\n",
                 statistics.duplicates);
  if (statistics.non_finite != 0)
    std::fprintf(stderr, "warning    %" PRIu64 " samples were not finite and are omitted\n", statistics.non_finite);
  for (const auto& [path, bytes, error] : summary.files) {
    std::fprintf(stderr, "wrote      %s, %zu bytes", path.c_str(), bytes);
    if (error.encoding >= 5e-4)
      std::fprintf(stderr, ", error at most %.3g levels, encoding %.3g", error.estimate, error.encoding);
    std::fputc('\n', stderr);
  }
}

constexpr const char* nothing_written = "interrupted; nothing was written";

/// Renders the image and sets the build and trace times of `summary`. Consumes the meshes of `scene`.
tracer::Result<tracer::Rendered, tracer::Failure> trace(tracer::Scene& scene, const tracer::Assets& assets,
                                                        const RenderOptions& options, tracer::RenderControl& control,
                                                        RenderSummary& summary) {
  Stopwatch watch;
  const Stopwatch whole;
  const ProgressBar bar(control, !options.quiet);
  const std::function<double()> elapsed_ms = [&] { return whole.elapsed_ms(); };
  const auto compiled = tracer::compile_taking_meshes(scene, control, assets, nullptr, elapsed_ms);
  summary.build_ms = watch.lap_ms();
  if (!compiled) return compiled.error();
  auto rendered = tracer::render(**compiled, {.elapsed_ms = elapsed_ms, .threads = options.threads}, control);
  summary.trace_ms = watch.lap_ms();
  summary.memory_bytes = tracer::memory_bytes(**compiled);
  summary.radiosity = tracer::radiosity_figures(**compiled);
  if (rendered) summary.memory_bytes += rendered->image.rgb.size() * sizeof(float);
  return rendered;
}

/// As the service reports a job, with the paths as names of the artifacts.
std::string report_of(const tracer::Scene& scene, const tracer::Rendered& rendered, const RenderSummary& summary) {
  std::vector<api::ReportedArtifact> artifacts;
  std::uint64_t memory_bytes = summary.memory_bytes;
  for (const auto& [path, bytes, error] : summary.files) {
    artifacts.push_back({path, error});
    memory_bytes += bytes;
  }
  api::StageTimes times;
  times.parse = summary.parse_ms;
  times.build = summary.build_ms;
  times.trace = summary.trace_ms;
  times.encode = summary.encode_ms;
  times.radiosity = summary.radiosity;
  return api::write_report(scene, rendered.error, artifacts, rendered.statistics, times, memory_bytes) + '\n';
}

/// Writes all files, then publishes all of them: after a full disk no old file has been replaced. Returns an exit code
/// on failure only. `files`: those of `outputs`, and that of the report if there is one.
std::optional<ExitCode> write_all(const tracer::Rendered& rendered, const tracer::Scene& scene,
                                  const std::vector<RenderOptions::Output>& outputs, std::vector<PendingFile>& files,
                                  const tracer::RenderControl& control, RenderSummary& summary) {
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    Stopwatch watch;
    const auto encoded = tracer::encode(rendered.image, outputs[i].format, scene.output);
    summary.encode_ms += watch.lap_ms();
    if (!encoded) return fail(encoded.error());
    if (const auto written = files[i].write(encoded->bytes); !written) return fail(written.error().message);
    summary.files.push_back(
        {outputs[i].path, encoded->bytes.size(), tracer::file_error(rendered.error, encoded->error)});
  }
  if (control.cancelled()) return fail(nothing_written, interrupted);
  if (files.size() > outputs.size()) {
    const std::string report = report_of(scene, rendered, summary);
    const std::span bytes(reinterpret_cast<const std::uint8_t*>(report.data()), report.size());
    if (const auto written = files.back().write(bytes); !written) return fail(written.error().message);
  }
  for (PendingFile& file : files) {
    if (const auto published = file.publish(); !published) return fail(published.error().message);
  }
  return std::nullopt;
}

}  // namespace

ExitCode run(const RenderOptions& options) {
  RenderSummary summary;
  Stopwatch watch;
  const auto text = read_document(options.scene);
  if (!text) return fail(text.error().message);
  auto loaded = load_scene(*text, options.scene);
  if (!loaded) {
    print_issues(stderr, loaded.error());
    return invalid_scene;
  }
  tracer::Scene& scene = loaded->document.scene;
  summary.parse_ms = watch.lap_ms();
  if (!options.quiet) print_warnings(stderr, scene);
  const tracer::PixelWindow window = scene.image.window();
  for (const RenderOptions::Output& output : options.outputs) {
    const std::uint32_t side_max = tracer::side_max(output.format);
    if (std::max(window.width(), window.height()) > side_max)
      return fail(output.path + ": a " + std::string(tracer::name(output.format)) + " file has at most " +
                  std::to_string(side_max) + " pixels on a side");
  }

  // --threads bounds the thread pool that scene building and the encoders use.
  std::optional<tbb::global_control> bound;
  if (options.threads != 0) bound.emplace(tbb::global_control::max_allowed_parallelism, options.threads);
  tracer::RenderControl control;
  const CancelOnSignal cancel_on_signal(control);
  std::vector<PendingFile> files;
  for (const RenderOptions::Output& output : options.outputs) {
    auto file = PendingFile::create(output.path);
    if (!file) return fail(file.error().message);
    files.push_back(std::move(*file));
  }

  const bool prints_report = options.report_path == "-";
  if (!options.report_path.empty() && !prints_report) {
    auto file = PendingFile::create(options.report_path);
    if (!file) return fail(file.error().message);
    files.push_back(std::move(*file));
  }

  const auto rendered = trace(scene, loaded->assets, options, control, summary);
  if (!rendered) return fail(rendered.error(), nothing_written);
  if (const auto stopped = write_all(*rendered, scene, options.outputs, files, control, summary)) return *stopped;
  if (prints_report) std::fputs(report_of(scene, *rendered, summary).c_str(), stdout);
  if (!options.quiet) print_summary(*rendered, summary);
  return success;
}

}  // namespace cli
