#pragma once
/// The options of a worker process, sent by the daemon.

#include <cstdint>
#include <string>

#include "tracer/limits.h"

namespace worker {

/// The files that scenes may name. Only the worker reads them, so it applies the limits on their content.
struct FileSettings {
  std::string directory;  ///< empty: files are not allowed
  std::string uploads;    ///< directory of uploads, named by their sha256 (queue::asset_path); empty: not allowed
  std::uint64_t objects = tracer::Limits{}.objects;
  std::uint64_t triangles = tracer::Limits{}.triangles;
  bool operator==(const FileSettings&) const = default;
};

struct Options {
  int slots = 1;                                 ///< jobs at once, 1..4096
  int threads = 0;                               ///< shared by all jobs, 0..1024; 0: those of the machine
  std::uint64_t job_memory_bytes = 16ull << 30;  ///< limit for each job
  std::uint64_t scene_cache_bytes = 0;           ///< limit of tracer::SceneCache
  std::uint64_t cache_idle_ms = 60'000;          ///< the cache is cleared after this time without a job
  FileSettings files;
  bool operator==(const Options&) const = default;
};

}  // namespace worker
