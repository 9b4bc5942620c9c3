/// Renders scenes once on one thread and prints the number of rays of each. instructions.py counts its instructions.
///
///     trace_model scene.json...

#include <cinttypes>
#include <cstdio>
#include <fstream>
#include <sstream>

#include "api/document.h"
#include "tracer/render.h"

namespace {

bool trace(const char* path) {
  std::stringstream text;
  text << std::ifstream(path).rdbuf();
  const auto document = api::parse_scene(text.str(), {});
  if (!document) return false;
  tracer::RenderControl control;
  const auto compiled = tracer::compile(document->scene, control);
  if (!compiled) return false;
  const auto rendered = tracer::render(**compiled, {.threads = 1}, control);
  if (!rendered) return false;
  std::printf("%" PRIu64 "\n", rendered->statistics.rays.total());
  return true;
}

}  // namespace

int main(int argc, char** argv) {
  for (int i = 1; i < argc; ++i) {
    if (trace(argv[i])) continue;
    std::fprintf(stderr, "%s: cannot be rendered\n", argv[i]);
    return 1;
  }
  return 0;
}
