/// Traces scenes once on one thread, by the integrator that their requirements pick or by the one that holds
/// everything, and prints which that is and how many rays it took: what instructions.py counts the instructions of.
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
#include "tracer/src/integrators/feature_set.h"

namespace {

bool trace(const char* path, bool full) {
  std::stringstream text;
  text << std::ifstream(path).rdbuf();
  const auto document = api::parse_scene(text.str(), {});
  if (!document) return false;
  tracer::RenderControl control;
  const auto compiled = tracer::compile(document->scene, control);
  if (!compiled) return false;
  // Picks the full model and is not asked for while rays are traced: code compiled in, not needed.
  if (full) const_cast<tracer::CompiledScene&>(**compiled).needs.soft_lights = true;
  const auto rendered = tracer::render(**compiled, {.threads = 1}, control);
  if (!rendered) return false;
  std::printf("%s %" PRIu64 "\n", tracer::suffices<tracer::ClassicModel>((*compiled)->needs) ? "classic" : "full",
              rendered->statistics.rays.total());
  return true;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) return 2;
  const bool full = std::string_view(argv[1]) == "full";
  for (int i = 2; i < argc; ++i) {
    if (trace(argv[i], full)) continue;
    std::fprintf(stderr, "%s: no image of it\n", argv[i]);
    return 1;
  }
  return 0;
}
