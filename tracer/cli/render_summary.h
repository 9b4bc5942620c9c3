#pragma once
/// Prints a summary of a render: rays, error, times, files.

#include <cstddef>
#include <cstdio>
#include <string>
#include <vector>

#include "tracer/render.h"

namespace cli {

struct RenderSummary {
  struct File {
    std::string path;
    std::size_t bytes = 0;
  };
  double parse_ms = 0, build_ms = 0, trace_ms = 0, encode_ms = 0;  ///< wall clock
  std::vector<File> files;
};

void print_summary(std::FILE* file, const tracer::Rendered& rendered, const RenderSummary& summary);

}  // namespace cli
