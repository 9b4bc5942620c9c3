#pragma once
/// What the user of `whittle diff` asked for.

#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <string>

#include "tracer/result.h"

namespace cli {

struct DiffOptions {
  std::array<std::string, 2> images;     ///< files, the reference first; at most one is "-", standard input
  std::optional<std::string> heat_path;  ///< of the heat map, a PNG
  std::optional<double> heat_white;      ///< levels; unset: as tracer::heat_scale finds
  std::optional<double> tolerance;       ///< levels of root mean square error
  std::size_t worst = 5;                 ///< how many pixels to list
  bool json = false;
};

/// `arguments` are those after "diff". Fails with a sentence that says what is wrong with them.
tracer::Result<DiffOptions, std::string> parse_diff_options(std::span<const char* const> arguments);

}  // namespace cli
