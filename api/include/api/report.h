#pragma once
/// The `report` of a finished job (api/docs/http.md) and the result of validating a document, as JSON text; the live
/// form of a scene, as a message.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tracer/compile.h"
#include "tracer/encode.h"
#include "tracer/live.h"
#include "tracer/render.h"
#include "tracer/requirements.h"
#include "tracer/scene.h"
#include "tracer/validate.h"

namespace api {

/// Wall-clock milliseconds of each stage. `queue` is set by the service (0 on the command line).
struct StageTimes {
  double queue = 0, parse = 0, build = 0, trace = 0, encode = 0;
  tracer::CacheHits cache_hits{};  ///< results of earlier jobs that shortened `parse` and `build`
  std::optional<tracer::RadiosityFigures> radiosity{};
};

/// Work of other nodes on the image.
struct Division {
  std::uint64_t workers = 1;         ///< that traced parts of it
  std::uint64_t tasks = 0;           ///< parts that any of them could trace; 0: the image was not divided
  std::uint64_t repeated_tasks = 0;  ///< further attempts at these, because workers ended
};

/// An image file of the job.
struct ReportedArtifact {
  std::string name;
  tracer::FileError error;
  std::uint64_t bytes = 0;  ///< size of the file; not in the report
};

/// The schema Report of api/openapi.yaml; `omitted` are warnings about parts of a model that the scene does not have,
/// of which the first hundred are written. Precondition: tracer::validate accepts `scene`. Throws std::bad_alloc only.
std::string write_report(const tracer::Scene& scene, const tracer::ErrorEstimate& error,
                         const std::vector<ReportedArtifact>& artifacts, const tracer::RenderStatistics& statistics,
                         const StageTimes& times, std::uint64_t memory_bytes, const Division& division = {},
                         const std::vector<std::string>& omitted = {});

/// The accuracy as the "accuracy" section of a document: the target error instead of a preset, and no defaults. The
/// section reads back as the same accuracy. Throws std::bad_alloc only.
std::string write_accuracy(const tracer::Accuracy& accuracy);

inline constexpr std::size_t report_bytes_max = 1u << 20;

/// The members of a report that metrics are computed from.
struct ReportFigures {
  bool of_render = false;  ///< false: the report is not one of write_report, and the other figures are 0
  tracer::RayCounts rays;
  std::optional<bool> target_met;         ///< unset without a target error
  std::optional<double> error_to_target;  ///< error estimate / target error; unset without a target error
  tracer::CacheHits cache_hits;
  std::optional<tracer::RadiosityFigures> radiosity{};  ///< its counts; unset without patches
};
/// The figures of a JSON object of at most `report_bytes_max` bytes that is nested at most 16 deep: one that every
/// reader of reports can handle. None for any other bytes. Members that are missing or of another type count as 0.
/// Throws std::bad_alloc only.
std::optional<ReportFigures> read_report(std::string_view report);

// ---- The result of validation, the schema Validation: one line. Invalid UTF-8 is replaced by U+FFFD.

/// `seconds` is estimated_work (api/estimate.h) times `seconds_per_work`, at most the time budget; null if neither is
/// known. Precondition: tracer::validate accepts `scene`.
std::string write_valid(const tracer::Scene& scene, std::optional<double> seconds_per_work);
std::string write_invalid(const std::vector<tracer::Issue>& errors);

/// A JSON pointer as a URI fragment (RFC 6901, section 6): characters that RFC 3986 excludes are percent-encoded.
std::string uri_fragment(const std::string& pointer);

/// `document` with `format` appended to its output.formats, otherwise unchanged.
/// Precondition: parse_scene accepts it.
std::string with_format(const std::string& document, tracer::Format format);

/// The message of POST /v1/live: 32-bit words, little-endian: the number 0x4556494c ("LIVE"), the bytes of the header,
/// the header, which is JSON as in api/docs/http.md with blanks up to a whole word, and the tables. `omitted`: of
/// leave_out().
std::string write_live(const tracer::Scene& scene, const tracer::LiveScene& live,
                       const std::vector<tracer::LiveOmission>& omitted);

}  // namespace api
