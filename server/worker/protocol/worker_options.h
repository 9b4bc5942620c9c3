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
  std::string directory;  ///< empty: none may be named
  std::string uploads;    ///< the directory of those named by their sha256 (queue::asset_path); empty: none may be
  std::uint64_t objects = tracer::Limits{}.objects;
  std::uint64_t triangles = tracer::Limits{}.triangles;
  bool operator==(const FileSettings&) const = default;
};

struct Options {
  int slots = 1;    ///< jobs at once, 1..4096
  int threads = 0;  ///< that trace a job which runs by itself, 0..1024; several share all but one each. 0: as many
                    ///< as the machine has
  std::uint64_t job_memory_bytes = 16ull << 30;  ///< most of each job
  std::uint64_t scene_cache_bytes = 0;           ///< tracer::SceneCache's bytes_max
  std::uint64_t cache_idle_ms = 60'000;          ///< without a job for so long, what it keeps goes: the sitting is over
  FileSettings files;
  bool operator==(const Options&) const = default;
};

/// "--slots", "2", ... without the program's name; parse_options gives the same options back.
std::vector<std::string> arguments_of(const Options& options);

/// Nothing where they are no such arguments.
std::optional<Options> parse_options(const std::vector<std::string_view>& arguments);

}  // namespace worker
