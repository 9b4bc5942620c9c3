#include <oneapi/tbb/global_control.h>

#include <chrono>
#include <cstdio>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tracer/cli/files.h"
#include "tracer/cli/load_scene.h"
#include "tracer/cli/messages.h"
#include "tracer/cli/progress.h"
#include "tracer/cli/render_summary.h"
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

constexpr const char* nothing_written = "interrupted; nothing was written";

/// Renders the image and sets the build and trace times of `summary`. Consumes the meshes of `scene`.
tracer::Result<tracer::Rendered, tracer::Failure> trace(tracer::Scene& scene, const tracer::Assets& assets,
                                                        const RenderOptions& options, tracer::RenderControl& control,
                                                        RenderSummary& summary) {
  Stopwatch watch;
  const Stopwatch whole;
  const ProgressBar bar(control, !options.quiet);
  const auto compiled = tracer::compile_taking_meshes(scene, control, assets);
  summary.build_ms = watch.lap_ms();
  if (!compiled) return compiled.error();
  auto rendered = tracer::render(
      **compiled, {.elapsed_ms = [&] { return whole.elapsed_ms(); }, .threads = options.threads}, control);
  summary.trace_ms = watch.lap_ms();
  return rendered;
}

/// Writes all files, then publishes all of them: after a full disk no old file has been replaced. Returns an exit code
/// on failure only.
std::optional<ExitCode> write_all(const tracer::Image& image, const tracer::Output& settings,
                                  const std::vector<RenderOptions::Output>& outputs, std::vector<PendingFile>& files,
                                  const tracer::RenderControl& control, RenderSummary& summary) {
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    Stopwatch watch;
    const auto bytes = tracer::encode(image, outputs[i].format, settings);
    summary.encode_ms += watch.lap_ms();
    if (!bytes) return fail(bytes.error());
    if (const auto written = files[i].write(*bytes); !written) return fail(written.error().message);
    summary.files.push_back({outputs[i].path, bytes->size()});
  }
  if (control.cancelled()) return fail(nothing_written, interrupted);
  for (PendingFile& file : files) {
    if (const auto published = file.publish(); !published) return fail(published.error().message);
  }
  return std::nullopt;
}

}  // namespace

ExitCode render(const RenderOptions& options) {
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

  const auto rendered = trace(scene, loaded->assets, options, control, summary);
  if (!rendered) return fail(rendered.error(), nothing_written);
  if (const auto stopped = write_all(rendered->image, scene.output, options.outputs, files, control, summary))
    return *stopped;
  if (!options.quiet) print_summary(stderr, *rendered, summary);
  return success;
}

}  // namespace cli
