#include <oneapi/tbb/global_control.h>

#include <algorithm>
#include <array>
#include <cinttypes>
#include <cmath>
#include <cstdio>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "api/cli/files.h"
#include "api/cli/messages.h"
#include "api/cli/progress.h"
#include "api/render_document.h"
#include "tracer/encode.h"

namespace cli {
namespace {

/// Rates are over the whole trace time, in which all kinds are traced together.
void print_rays(const tracer::RayCounts& rays, double trace_ms) {
  const auto print = [us = std::max(trace_ms, 1e-3) * 1000](const char* kind, std::uint64_t count) {
    if (count == 0) return;
    std::fprintf(stderr, "%-10s %14" PRIu64 " rays %9.2f million/s\n", kind, count, static_cast<double>(count) / us);
  };
  for (const auto& [kind, count] : tracer::ray_kinds) print(kind, rays.*count);
  print("all", rays.total());
}

/// The error estimate, its parts other than sampling, the bound that is proven, and the worst tile.
void print_error(const tracer::ErrorEstimate& error) {
  std::fprintf(stderr, "error      at most %.3g levels (%.0f %% confidence)", error.estimate, 100 * error.confidence);
  for (const auto& [part, levels] : {std::pair{"depth", error.depth},
                                     {"cutoff", error.cutoff},
                                     {"approximation", error.approximation},
                                     {"tone", error.tone}})
    if (levels >= 5e-4) std::fprintf(stderr, "; %s %.3g", part, levels);
  std::fputs(error.bounded ? "\n" : "; the radiance of this scene has no bound\n", stderr);
  if (std::isfinite(error.proven))
    std::fprintf(stderr, "proven     at most %.3g levels, by %" PRIu64 " looks\n", error.proven, error.looks);
  if (error.worst_tile > 0 || error.tile_target) std::fprintf(stderr, "worst tile %.3g levels\n", error.worst_tile);
}

/// The last lines: which targets are met, and why sampling ended without them.
void print_targets(const tracer::ErrorEstimate& error) {
  // In the order of ErrorEstimate::Limit.
  constexpr std::array<const char*, 6> reasons{"the number of samples is fixed",
                                               "",
                                               "the time budget is used",
                                               "samples_max is reached everywhere",
                                               "parts that samples cannot lower exceed the target",
                                               "nothing visible is left"};
  const std::string reason = reasons[static_cast<std::size_t>(error.limit)];
  const auto print = [&](const char* name, double target, double found) {
    std::fprintf(stderr, "%s %.3g: %s\n", name, target, found <= target ? "met" : ("missed, " + reason).c_str());
  };
  if (error.target) print("target", *error.target, error.estimate);
  if (error.tile_target) print("tile target", *error.tile_target, error.worst_tile);
  if (!error.target && !error.tile_target && error.limit != tracer::ErrorEstimate::Limit::none)
    std::fprintf(stderr, "ended      %s\n", reason.c_str());
}

void print_summary(const api::DocumentRender& render) {
  const tracer::RenderStatistics& statistics = render.rendered.statistics;
  std::fprintf(stderr, "image      %" PRIu32 " x %" PRIu32 ", %" PRIu64 " samples\n", render.rendered.image.width,
               render.rendered.image.height, statistics.samples);
  print_rays(statistics.rays, render.times.trace);
  print_error(render.rendered.error);
  std::fprintf(stderr, "time       parse %.1f ms, build %.1f ms, trace %.1f ms, encode %.1f ms\n", render.times.parse,
               render.times.build, render.times.trace, render.times.encode);
  for (const auto& [name, count, note] :
       {std::tuple{"culled", statistics.culled_shadow_rays, "shadow rays of negligible lights"},
        {"duplicates", statistics.duplicates, "shapes or triangles equal earlier ones and are left out"},
        {"warning", statistics.non_finite, "samples were not finite and are omitted"}})
    if (count != 0) std::fprintf(stderr, "%-10s %" PRIu64 " %s\n", name, count, note);
  for (const auto& [path, error, bytes] : render.artifacts) {
    std::fprintf(stderr, "wrote      %s, %" PRIu64 " bytes", path.c_str(), bytes);
    if (error.encoding >= 5e-4)
      std::fprintf(stderr, ", error at most %.3g levels, encoding %.3g", error.estimate, error.encoding);
    std::fputc('\n', stderr);
  }
  print_targets(render.rendered.error);
}

constexpr const char* nothing_written = "interrupted; nothing was written";

/// Compiles and traces the scene behind a progress bar.
tracer::Result<std::monostate, tracer::Failure> trace(api::DocumentRender& render, const RenderOptions& options,
                                                      tracer::RenderControl& control) {
  const ProgressBar bar(control, !options.quiet);
  if (auto compiled = render.compile(control); !compiled) return compiled;
  auto traced = render.trace({.threads = options.threads}, control);
  render.compiled = nullptr;  // frees it: the files need memory, too
  return traced;
}

/// Writes all files, then publishes all of them: after a full disk no old file has been replaced. Returns an exit code
/// on failure only. `files`: those of `outputs`, and that of the report if there is one.
std::optional<ExitCode> write_all(api::DocumentRender& render, const std::vector<RenderOptions::Output>& outputs,
                                  std::vector<PendingFile>& files, const tracer::RenderControl& control) {
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    const auto bytes = render.encode(outputs[i].format, outputs[i].path);
    if (!bytes) return fail(bytes.error());
    files[i].write(*bytes);
  }
  if (control.cancelled()) return fail(nothing_written, interrupted);
  if (files.size() > outputs.size()) {
    const std::string report = render.report() + '\n';
    files.back().write({reinterpret_cast<const std::uint8_t*>(report.data()), report.size()});
  }
  for (PendingFile& file : files) file.publish();
  return std::nullopt;
}

}  // namespace

ExitCode run(const RenderOptions& options) {
  api::DocumentRender render;
  if (const auto loaded = load_scene(render, read_document(options.scene), options.scene); !loaded) {
    print_issues(stderr, loaded.error());
    return invalid_scene;
  }
  const tracer::Scene& scene = render.document.scene;
  if (!options.quiet) {
    print_omitted(stderr, render.omitted);
    print_warnings(stderr, scene);
  }
  const tracer::PixelWindow window = scene.image.window();
  for (const RenderOptions::Output& output : options.outputs) {
    const std::uint32_t side_max = tracer::row(output.format).side_max;
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
  for (const RenderOptions::Output& output : options.outputs) files.emplace_back(output.path);
  const bool prints_report = options.report_path == "-";
  if (!options.report_path.empty() && !prints_report) files.emplace_back(options.report_path);

  if (const auto done = trace(render, options, control); !done) return fail(done.error(), nothing_written);
  if (const auto stopped = write_all(render, options.outputs, files, control)) return *stopped;
  if (prints_report) std::puts(render.report().c_str());
  if (!options.quiet) print_summary(render);
  return options.require_target && !render.rendered.error.target_met ? target_missed : success;
}

}  // namespace cli
