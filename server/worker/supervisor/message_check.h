#pragma once
/// Validates what the worker sends before the daemon uses any of it: the worker parses untrusted input, so its process
/// may be in the hands of the author of that input. Pure functions, tested as tables and fuzzed.

#include <cstdint>
#include <string>

#include "api/report.h"
#include "server/queue/job.h"
#include "server/worker/protocol/protocol.h"
#include "tracer/result.h"

namespace worker {

// A violation is the end of a sentence that begins "The worker process".

/// Checks all that does not depend on a job: the kind of the message, the length of its texts, codes of problems, the
/// size of previews. Empty if the message is valid.
std::string violation_of(const Message& message);

/// The figures of the report of a valid result, or the violation. A result has a report (api::read_report) and at least
/// one file, each name once. The files of a render are those of its formats, with at most `image_bytes_max` bytes;
/// those of a measurement are measurement_files.
tracer::Result<api::ReportFigures, std::string> check_result(const Finished& result, const queue::Job& job);

/// EXR with all layers, the largest format, takes 52 bytes a pixel. The rest is for headers.
constexpr std::uint64_t image_bytes_max(std::uint32_t width, std::uint32_t height) {
  return (std::uint64_t{64} << 10) + std::uint64_t{64} * width * height;
}

/// Bounds the files of a measurement except its reference, which do not depend on the size of its images.
constexpr std::uint64_t measurement_bytes_max = 16u << 20;

}  // namespace worker
