/// Renders scenes once on one thread, with the integrator that their requirements select or with the one that has all
/// features, and prints its name and the number of rays. instructions.py counts its instructions.
///
///     trace_model picked|full scene.json...

#include <cinttypes>
#include <cstdio>
#include <fstream>
#include <sstream>
#include <string_view>

#include "api/document.h"
#include "tracer/render.h"
#include "tracer/src/compiled/compiled_scene.h"
#include "tracer/src/integrators/whitted/wavefront_state.h"

namespace {

bool trace(const char* path, bool full) {
  std::stringstream text;
  text << std::ifstream(path).rdbuf();
  const auto document = api::parse_scene(text.str(), {});
  if (!document) return false;
  tracer::RenderControl control;
  const auto compiled = tracer::compile(document->scene, control);
  if (!compiled) return false;
  // This selects the full model and changes nothing else: its code is compiled in but not needed.
  if (full) const_cast<tracer::CompiledScene&>(**compiled).needs.soft_lights = true;
  const auto rendered = tracer::render(**compiled, {.threads = 1}, control);
  if (!rendered) return false;
  std::printf("%s %" PRIu64 "\n", tracer::supports<tracer::WhittedFeatures>((*compiled)->needs) ? "classic" : "full",
              rendered->statistics.rays.total());
  return true;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) return 2;
  const bool full = std::string_view(argv[1]) == "full";
  for (int i = 2; i < argc; ++i) {
    if (trace(argv[i], full)) continue;
    std::fprintf(stderr, "%s: cannot be rendered\n", argv[i]);
    return 1;
  }
  return 0;
}
