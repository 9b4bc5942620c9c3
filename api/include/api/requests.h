#pragma once
/// The bodies of small requests: about uploaded files, with their replies; changes of a job; measurements.

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "api/document.h"
#include "tracer/result.h"

namespace api {

/// Maximum of one request. A scene of a thousand files is large; ten thousand lookups take some tens of ms.
inline constexpr std::size_t asset_hashes_max = 10'000;

/// Reads {"sha256": ["64 lower-case hex digits", ...]}; any bytes, as parse_scene. The hashes are returned in their
/// order, without duplicates.
tracer::Result<std::vector<std::string>, Refusal> parse_asset_hashes(std::string_view bytes, const Limits& limits);

/// {missing: [...]}
std::string write_missing(const std::vector<std::string>& hashes);

/// {sha256, bytes}
std::string write_asset(const std::string& sha256, std::uint64_t bytes);

/// An RFC 3339 time as ms since 1970 UTC, as in a document: years 1970 to 9999.
std::optional<std::int64_t> parse_time(std::string_view text);

/// The body of PATCH /v1/jobs/{id}, a JSON merge patch (RFC 7396).
/// {priority, name, labels{NAME: VALUE|null}, expires_at|null}, each optional. Unset: unchanged.
struct RequestedChange {
  std::optional<int> priority;  ///< 0..100
  std::optional<std::string> name;
  std::map<std::string, std::optional<std::string>> labels;  ///< null: removed; labels that are not named are kept
  std::optional<std::optional<std::int64_t>> expires_at;     ///< ms since 1970 UTC; null: never
};

/// Parses the change of a job. Like parse_scene it returns all issues at once and never throws.
tracer::Result<RequestedChange, Refusal> parse_change(std::string_view bytes, const Limits& limits);

/// The body of POST /v1/jobs/bulk: an action on jobs that are named by id or by a filter.
struct BulkRequest {
  enum class Action { cancel, retry, remove, priority };
  Action action = Action::cancel;
  std::vector<std::string> ids;  ///< at most bulk_jobs_max, without duplicates; empty with a filter
  /// Parameters of GET /v1/jobs as they are in a URL, not checked; not empty where `ids` is.
  std::vector<std::pair<std::string, std::string>> filter;
  int priority = 0;  ///< 0..100, of Action::priority
  bool dry_run = false;
};
inline constexpr std::size_t bulk_jobs_max = 10'000;

/// Reads {"action", "ids"|"filter", "value", "dry_run"}. As parse_scene: all issues at once, never throws.
tracer::Result<BulkRequest, Refusal> parse_bulk(std::string_view bytes, const Limits& limits);

/// The body of POST /v1/compare: two images, each as the sha256 of an upload, the id of a job, or "ID/image.exr".
struct CompareRequest {
  std::string a, b;
  std::optional<double> tolerance;  ///< levels, >= 0
  bool heat = false;
};
/// Reads {"a", "b", "tolerance"?, "heat"?}. As parse_scene: all issues at once, never throws.
tracer::Result<CompareRequest, Refusal> parse_compare(std::string_view bytes, const Limits& limits);

/// Reads {"path"} of POST /v1/tickets: below /v1/, with or without a query. As parse_scene: never throws.
tracer::Result<std::string, Refusal> parse_ticket(std::string_view bytes, const Limits& limits);

/// Reads a webhook, as in a document. As parse_scene: all issues at once, never throws.
tracer::Result<Webhook, Refusal> parse_webhook(std::string_view bytes, const Limits& limits);

/// Maximum samples per pixel of a reference: for a scene of 320 x 240 pixels, hours on two cores.
inline constexpr std::uint32_t measure_reference_samples_max = 1'000'000;

/// The body of POST /v1/measure: a scene, and the parameters to vary.
struct MeasureRequest {
  Document document;
  std::vector<std::string> parameters;  ///< elements of tracer::parameters, each at most once; empty: all
  std::uint32_t reference_samples = 0;  ///< per pixel; the default is that of tracer::MeasureSettings
};

/// Reads {"scene": document, "settings"?: {"parameters"?: [name, ...], "reference_samples"?: count}}. Refused as by
/// parse_scene, with all issues of the scene and the settings at once; their pointers begin at the body's root
/// ("/scene/camera"). The scene's limit samples_times_pixels also applies to the reference. Time and memory are those
/// of parse_scene. Never throws.
tracer::Result<MeasureRequest, Refusal> parse_measure(std::string_view bytes, const Limits& limits);

}  // namespace api
