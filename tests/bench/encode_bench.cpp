/// How long an image of 1920x1080 takes to become a file, and how large the file is.
///
///     encode_bench scenes/sphereflake.json
/// The image is traced once, with one sample a pixel: the hardest to pack, for no edge is smoothed.

#include <benchmark/benchmark.h>

#include <cstdio>
#include <fstream>
#include <sstream>
#include <string>

#include "api/document.h"
#include "tracer/compile.h"
#include "tracer/encode.h"
#include "tracer/render.h"

namespace {

void encode(benchmark::State& state, const tracer::Image& image, tracer::Format format) {
  std::size_t bytes = 0;
  for ([[maybe_unused]] auto _ : state) {
    const auto encoded = tracer::encode(image, format);
    if (!encoded) return state.SkipWithError(encoded.error().c_str());
    bytes = encoded->size();
  }
  state.counters["bytes"] = static_cast<double>(bytes);
}

int run(const char* path) {
  std::stringstream text;
  text << std::ifstream(path).rdbuf();
  auto document = api::parse_scene(text.str(), {});
  if (!document) {
    std::fprintf(stderr, "%s: not a scene; `whittle check` tells why\n", path);
    return 1;
  }
  document->scene.image = {1920, 1080};
  document->scene.accuracy.samples = 1;
  tracer::RenderControl control;
  const auto compiled = tracer::compile(document->scene, control);
  if (!compiled) return 1;
  const auto rendered = tracer::render(**compiled, {}, control);
  if (!rendered) return 1;
  for (const auto format : {tracer::Format::png, tracer::Format::exr}) {
    const std::string name = std::string(path) + " 1920x1080 " + std::string(tracer::extension(format));
    benchmark::RegisterBenchmark(name.c_str(), [&rendered, format](benchmark::State& state) {
      encode(state, rendered->image, format);
    })->Unit(benchmark::kMillisecond);
  }
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}

}  // namespace

int main(int count, char** arguments) {
  benchmark::Initialize(&count, arguments);
  if (count != 2) {
    std::fprintf(stderr, "usage: encode_bench SCENE [options of Google Benchmark]\n");
    return 2;
  }
  return run(arguments[1]);
}
