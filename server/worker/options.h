#pragma once
/// What the daemon tells a worker on its command line; both sides of it.

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tracer/limits.h"

namespace worker {

/// The files that scenes may name. The daemon sees no content of them, so the limits on it are kept here.
struct FileSettings {
  std::string folder;   ///< empty: none may be named
  std::string uploads;  ///< the folder of those named by their sha256 (jobs::asset_path); empty: none may be
  std::uint64_t objects = tracer::Limits{}.objects;
  std::uint64_t triangles = tracer::Limits{}.triangles;
  bool operator==(const FileSettings&) const = default;
};

struct Options {
  int slots = 1;                                 ///< jobs at once, 1..4096
  std::uint64_t job_memory_bytes = 16ull << 30;  ///< most of each of them
  FileSettings files;
  bool operator==(const Options&) const = default;
};

/// "--slots", "2", ... without the program's name; parse_options gives the same options back.
std::vector<std::string> arguments_of(const Options& options);

/// Nothing where they are no such arguments.
std::optional<Options> parse_options(const std::vector<std::string_view>& arguments);

}  // namespace worker
