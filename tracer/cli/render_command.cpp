#include <oneapi/tbb/global_control.h>

#include <chrono>
#include <cstdio>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "api/document.h"
#include "tracer/cli/asset_directory_files.h"
#include "tracer/cli/commands.h"
#include "tracer/cli/files.h"
#include "tracer/cli/issues.h"
#include "tracer/cli/progress.h"
#include "tracer/cli/render_summary.h"
#include "tracer/compile.h"
#include "tracer/encode.h"
#include "tracer/render.h"

namespace cli {
namespace {

using std::chrono::steady_clock;

/// Milliseconds since the last lap, or since it was made.
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

ExitCode complain(const std::string& sentence, ExitCode code = bad_environment) {
  std::fprintf(stderr, "whittle: %s\n", sentence.c_str());
  return code;
}

ExitCode complain(const tracer::Failure& failure) {
  if (failure.code == tracer::Failure::Code::cancelled)
    return complain("interrupted; nothing was written", interrupted);
  if (failure.code == tracer::Failure::Code::bad_asset) {
    print_issue(stderr, {failure.pointer, "bad_asset", failure.detail});
    return bad_scene;
  }
  return complain(failure.detail);
}

/// The image, with build and trace times in `figures`. Takes the scene's meshes.
tracer::Result<tracer::Rendered, tracer::Failure> trace(tracer::Scene& scene, const tracer::Assets& assets,
                                                        const Options& options, tracer::RenderControl& control,
                                                        Figures& figures) {
  Stopwatch watch;
  const Stopwatch whole;
  const ProgressBar bar(control, !options.quiet);
  const auto compiled = tracer::compile_taking_meshes(scene, control, assets);
  figures.build_ms = watch.lap_ms();
  if (!compiled) return compiled.error();
  auto rendered = tracer::render(
      **compiled, {.elapsed_ms = [&] { return whole.elapsed_ms(); }, .threads = options.threads}, control);
  figures.trace_ms = watch.lap_ms();
  return rendered;
}

/// Writes all of them, then gives all of them their names: a full disk leaves the old images, not a mixture.
std::optional<ExitCode> write_all(const tracer::Image& image, const tracer::Output& settings,
                                  const std::vector<Output>& outputs, std::vector<PendingFile>& files,
                                  const tracer::RenderControl& control, Figures& figures) {
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    Stopwatch watch;
    const auto bytes = tracer::encode(image, outputs[i].format, settings);
    figures.encode_ms += watch.lap_ms();
    if (!bytes) return complain(bytes.error());
    if (const auto written = files[i].write(*bytes); !written) return complain(written.error().sentence);
    figures.files.push_back({outputs[i].path, bytes->size()});
  }
  if (control.cancelled()) return complain("interrupted; nothing was written", interrupted);
  for (PendingFile& file : files) {
    if (const auto published = file.publish(); !published) return complain(published.error().sentence);
  }
  return std::nullopt;
}

}  // namespace

ExitCode render(const Options& options) {
  Figures figures;
  Stopwatch watch;
  const auto bytes = read_all(options.scene_path, api::DocumentLimits{}.bytes);
  if (!bytes) return complain(bytes.error().sentence);
  auto loaded = load(*bytes, options.scene_path, options.uploads_directory);
  if (!loaded) {
    print_issues(stderr, loaded.error());
    return bad_scene;
  }
  tracer::Scene& scene = loaded->document.scene;
  figures.parse_ms = watch.lap_ms();

  // The scene's build and the encoders use whatever pool there is; this bounds it as --threads says.
  std::optional<tbb::global_control> bound;
  if (options.threads != 0) bound.emplace(tbb::global_control::max_allowed_parallelism, options.threads);
  tracer::RenderControl control;
  const CancelOnSignal cancel_on_signal(control);
  std::vector<PendingFile> files;
  for (const Output& output : options.outputs) {
    auto file = PendingFile::create(output.path);
    if (!file) return complain(file.error().sentence);
    files.push_back(std::move(*file));
  }

  const auto rendered = trace(scene, loaded->assets, options, control, figures);
  if (!rendered) return complain(rendered.error());
  if (const auto stopped = write_all(rendered->image, scene.output, options.outputs, files, control, figures))
    return *stopped;
  if (!options.quiet) print_figures(stderr, *rendered, figures);
  return done;
}

}  // namespace cli
