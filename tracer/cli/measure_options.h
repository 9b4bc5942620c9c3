#pragma once
/// What the user of `whittle measure` asked for.

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "tracer/measure.h"
#include "tracer/result.h"

namespace cli {

struct MeasureOptions {
  std::string scene_path;                                       ///< "-" is standard input
  std::string uploads_directory;                                ///< of files named by their sha256; empty: none
  std::string name;                                             ///< of the files, without their endings
  std::optional<std::pair<std::uint32_t, std::uint32_t>> size;  ///< pixels; in place of the document's
  std::optional<double> scale;                                  ///< of the document's size
  std::vector<std::string> knobs;                               ///< empty: all
  std::uint32_t reference_samples = tracer::MeasureSettings().reference_samples;
  std::uint32_t threads = 0;  ///< 0 is one per processor
  bool quiet = false;         ///< no progress, no table
};

/// `arguments` are those after "measure". Fails with a sentence that says what is wrong with them.
tracer::Result<MeasureOptions, std::string> parse_measure_options(std::span<const char* const> arguments);

}  // namespace cli
