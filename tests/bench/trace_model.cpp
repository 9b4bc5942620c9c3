/// Traces a scene once on one thread, by the integrator that its requirements pick or by the one that holds everything:
/// what model_instructions.py counts the instructions of.
///
///     trace_model scene.json picked|full

#include <cstdio>
#include <fstream>
#include <sstream>
#include <string_view>

#include "api/document.h"
#include "tracer/render.h"
#include "tracer/src/compiled_scene.h"
#include "tracer/src/integrator/model.h"

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  const std::string_view model = argv[2];
  std::stringstream text;
  text << std::ifstream(argv[1]).rdbuf();
  const auto document = api::parse_scene(text.str(), {});
  if (!document) return 1;
  tracer::RenderControl control;
  const auto compiled = tracer::compile(document->scene, control);
  if (!compiled) return 1;
  // Picks the full model and is not asked for while rays are traced: code compiled in, not needed.
  if (model == "full") const_cast<tracer::CompiledScene&>(**compiled).needs.soft_lights = true;
  std::printf("%s\n", tracer::suffices<tracer::ClassicModel>((*compiled)->needs) ? "classic" : "full");
  return tracer::render(**compiled, {.threads = 1}, control) ? 0 : 1;
}
