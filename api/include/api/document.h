#pragma once
/// Reads scene documents (version 1): bytes to tracer::Scene, or all issues at once. JSON types do not leave this
/// module.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tracer/limits.h"
#include "tracer/result.h"
#include "tracer/scene.h"
#include "tracer/validate.h"

namespace api {

/// Limits of the document itself, checked before a value is stored (the last two are reported as issues). Honest scenes
/// are far below them, and parsing at the limits takes about a second and bounded memory.
struct DocumentLimits {
  std::size_t bytes = 64u << 20;
  std::size_t depth = 32;           ///< the format (api/docs/scene.md) needs 8
  std::size_t values = 20'000'000;  ///< with keys; 16 bytes each while reading
  std::size_t string_bytes = 1u << 20;
  std::size_t key_bytes = 256;
  std::size_t number_chars = 64;
  std::size_t name_bytes = 256;  ///< names of scenes and jobs, and labels: they are shown in lists
  std::size_t labels = 64;
};

/// The files that a document may name. The caller loads them afterwards (api/load_assets.h).
enum class Files {
  none,
  anywhere,           ///< any path: for the command line, whose user may read what it reads
  below_a_directory,  ///< plain names between slashes: none is empty, "." or "..", and there are no backslashes
};

/// Prefix of the name of an uploaded file; its sha256 follows, as 64 lower-case hex digits.
inline constexpr std::string_view upload_prefix = "sha256:";

struct Limits {
  DocumentLimits document;
  tracer::Limits scene;
  Files files = Files::none;
  bool uploads = false;  ///< documents may name uploaded files
  bool webhooks = true;  ///< jobs may have a webhook
};

/// A URL that is called when a job ends, and the states for which it is.
struct Webhook {
  std::string url;                                                      ///< http or https
  std::vector<std::string> events{"succeeded", "failed", "cancelled"};  ///< each once, at least one
  bool operator==(const Webhook&) const = default;
};

/// Use of cached images of the same scene.
enum class CacheUse {
  use,      ///< a cached image is returned
  refresh,  ///< the scene is rendered, and its image replaces the cached one
  off,      ///< the scene is rendered, and its image is not cached
};
constexpr auto words_of(CacheUse first) { return tracer::in_order(first, {"use", "refresh", "off"}); }

/// The optional "job" member: instructions for the service. The command line ignores it. Times are milliseconds since
/// 1970 UTC.
struct JobRequest {
  std::string name;  ///< default: the scene's name
  std::map<std::string, std::string> labels;
  int priority = 50;                         ///< 0..100, higher first
  int max_attempts = 3;                      ///< 1..10
  std::optional<std::int64_t> run_after;     ///< earliest start
  std::optional<std::int64_t> deadline;      ///< the job fails if it has not ended by then; later than run_after
  std::optional<std::int64_t> expires_in_s;  ///< lifetime of its images after its end, 1 s to 10 years
  CacheUse cache = CacheUse::use;
  bool keep = true;  ///< false: the job is not listed, and removed soon after its end
  std::optional<Webhook> webhook;
  bool operator==(const JobRequest&) const = default;

  static constexpr auto fields() {
    using tracer::Field, tracer::FieldRange, tracer::optional_field;
    return std::tuple{optional_field("name", &JobRequest::name), optional_field("labels", &JobRequest::labels),
                      optional_field("priority", &JobRequest::priority, FieldRange::within(0, 100)),
                      optional_field("max_attempts", &JobRequest::max_attempts, FieldRange::within(1, 10)),
                      Field{"run_after", &JobRequest::run_after, FieldRange::time},
                      Field{"deadline", &JobRequest::deadline, FieldRange::time},
                      // Up to ten years; without the field, images are kept.
                      Field{"expires_in", &JobRequest::expires_in_s, FieldRange::within(1, 315360000)},
                      optional_field("cache", &JobRequest::cache), optional_field("keep", &JobRequest::keep),
                      Field{"webhook", &JobRequest::webhook}};
  }
};

/// The model that a document stands for (api/import_model.h).
struct ModelFile {
  std::string name;            ///< name of the file, as `scene.assets` has it
  std::optional<double> time;  ///< seconds of its first animation
  std::string members;         ///< canonical text of the document
};

struct Document {
  tracer::Scene scene;  ///< accepted by tracer::validate; files of meshes are not yet read (api/load_assets.h)
  JobRequest job;
  std::optional<ModelFile> model{};  ///< if it is set, `scene` has only what the document itself has
};

/// Reason why a document was refused.
struct Refusal {
  enum class Kind {
    not_json,   ///< `detail` describes the error at `line` and `column` (1-based; column counts bytes). No issues.
    too_large,  ///< over a DocumentLimits bound; `detail` has the limit and the value. No issues.
    invalid,    ///< `issues` has all issues in document order, at most 1000 of the reader and 1000 of validation, then
                ///< "too_many_issues" with the count of the others.
  };
  Kind kind = Kind::invalid;
  std::string detail;
  std::size_t line = 0, column = 0;
  std::vector<tracer::Issue> issues;
};

/// The sha256 of the canonical text of each member of a document except "job", by name. Canonical texts are equal for
/// values with the same content in another order, with other blanks, escapes or spellings of numbers: members are
/// sorted by the bytes of their names, and numbers are the shortest decimals that read back as the same double.
using Digests = std::map<std::string, std::string, std::less<>>;

/// Time and memory are linear in `bytes` and bounded by `limits` (at the default bounds: seconds, and about 1 GB).
/// Accepts any bytes and never throws: if memory runs out, the document is `too_large`. Thread-safe.
///
/// If `digests` is given and the document is valid and one of `digests_of`, it receives those of its members.
enum class DigestsOf { all_scenes, scenes_with_patches };
tracer::Result<Document, Refusal> parse_scene(std::string_view bytes, const Limits& limits, Digests* digests = nullptr,
                                              DigestsOf digests_of = DigestsOf::all_scenes);

}  // namespace api
