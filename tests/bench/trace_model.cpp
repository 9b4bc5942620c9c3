/// Renders scenes once on one thread, with the integrator that their requirements select or with the one that has all
/// features, and prints its name and the number of rays. instructions.py counts its instructions. With `bounds`: the
/// time of bound_pixels() and of an image with one sample per pixel, and the pixels whose interval is at most a level
/// wide.
///
///     trace_model picked|full|bounds scene.json...

#include <algorithm>
#include <cinttypes>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string_view>

#include "api/document.h"
#include "tracer/render.h"
#include "tracer/src/certify/pixel_bounds.h"
#include "tracer/src/compiled/compiled_scene.h"
#include "tracer/src/display/display_transform.h"
#include "tracer/src/integrators/whitted/wavefront_state.h"

namespace {

/// Processor time: other programs of the machine do not count.
double milliseconds_since(std::clock_t start) {
  return 1000.0 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
}

void bound(const char* path, const tracer::CompiledScene& scene, double render_ms) {
  const tracer::RenderControl control;
  const tracer::InParallel one_by_one = [](std::uint64_t count, const std::function<void(std::uint64_t)>& work) {
    for (std::uint64_t i = 0; i < count; ++i) work(i);
  };
  const auto start = std::clock();
  const auto intervals = tracer::bound_pixels(scene, scene.accuracy.approximate, one_by_one, control);
  const double bound_ms = milliseconds_since(start);
  const tracer::DisplayTransform display(scene.output, 0);
  std::size_t certified = 0, edges = 0, unbounded = 0;
  double squares = 0;  // of the widths
  for (const tracer::RadianceInterval& interval : intervals) {
    double width = 0;
    for (std::size_t c = 0; c < 3; ++c)
      width = std::max(width, display.level(std::min(interval.high[c], 1e30f)) - display.level(interval.low[c]));
    squares += width * width;
    certified += width <= 1 ? 1 : 0;
    edges += interval.edge ? 1 : 0;
    unbounded += std::isinf(interval.high[0]) ? 1 : 0;
  }
  const double percent = 100.0 / static_cast<double>(intervals.size());
  std::printf(
      "%-20s certified %5.1f %%  edges %5.1f %%  unbounded %5.1f %%  width %5.1f  %7.1f ms, one sample %7.1f ms\n",
      std::filesystem::path(path).filename().c_str(), static_cast<double>(certified) * percent,
      static_cast<double>(edges) * percent, static_cast<double>(unbounded) * percent,
      std::sqrt(squares / static_cast<double>(intervals.size())), bound_ms, render_ms);
}

bool trace(const char* path, std::string_view mode) {
  std::stringstream text;
  text << std::ifstream(path).rdbuf();
  auto document = api::parse_scene(text.str(), {});
  if (!document) return false;
  if (mode == "bounds") {
    document->scene.image = {640, 480};
    document->scene.accuracy = {};
    document->scene.accuracy.samples = 1;
  }
  tracer::RenderControl control;
  const auto compiled = tracer::compile(document->scene, control);
  if (!compiled) return false;
  // This selects the full model and changes nothing else: its code is compiled in but not needed.
  if (mode == "full") const_cast<tracer::CompiledScene&>(**compiled).needs.soft_lights = true;
  const auto start = std::clock();
  const auto rendered = tracer::render(**compiled, {.threads = 1}, control);
  if (!rendered) return false;
  if (mode == "bounds") {
    bound(path, **compiled, milliseconds_since(start));
    return true;
  }
  std::printf("%s %" PRIu64 "\n", tracer::supports<tracer::WhittedFeatures>((*compiled)->needs) ? "classic" : "full",
              rendered->statistics.rays.total());
  return true;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) return 2;
  for (int i = 2; i < argc; ++i) {
    if (trace(argv[i], argv[1])) continue;
    std::fprintf(stderr, "%s: cannot be rendered\n", argv[i]);
    return 1;
  }
  return 0;
}
