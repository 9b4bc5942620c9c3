#pragma once
/// What a render took, for the person who asked for it.

#include <cstddef>
#include <cstdio>
#include <string>
#include <vector>

#include "tracer/render.h"

namespace cli {

struct Figures {
  struct File {
    std::string path;
    std::size_t bytes = 0;
  };
  double parse_ms = 0, build_ms = 0, trace_ms = 0, encode_ms = 0;  ///< wall clock
  std::vector<File> files;
};

/// Image size, rays by kind with their share of the trace time's rate, times by stage, files.
void print_figures(std::FILE* into, const tracer::Rendered& rendered, const Figures& figures);

}  // namespace cli
