#pragma once
/// Reads scene documents (version 1): bytes in, tracer::Scene out, or everything that is wrong with them at once.
/// No JSON type is seen outside this room.

#include <cstddef>
#include <cstdint>
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

/// Bounds on the document itself, checked before a value of it is kept (the last two are told as issues, since only a
/// part is too long). Reasons: honest scenes are far below them, and
/// parsing at the bound takes under a second and bounded memory.
struct DocumentLimits {
  std::size_t bytes = 64u << 20;
  std::size_t depth = 32;           ///< api/docs/scene.md needs 8
  std::size_t values = 20'000'000;  ///< keys included; 16 bytes each while reading
  std::size_t string_bytes = 1u << 20;
  std::size_t key_bytes = 256;
  std::size_t number_chars = 64;
  std::size_t name_bytes = 256;  ///< of the scene's and the job's name and of labels: they are shown in lists
  std::size_t labels = 64;
};

/// The files that a document may name. Whoever lets it name any loads them afterwards (api/load_assets.h).
enum class Files {
  none,
  anywhere,           ///< any path: for the command line, whose user may read what it reads
  below_a_directory,  ///< plain names between slashes: none is empty, "." or "..", and there are no backslashes
};

/// How a document begins the name of an uploaded file; its sha256 follows, as 64 lower-case hex digits.
inline constexpr std::string_view upload_prefix = "sha256:";

struct Limits {
  DocumentLimits document;
  tracer::Limits scene;
  Files files = Files::none;
  bool uploads = false;  ///< whether documents may name uploaded files
  bool webhooks = true;  ///< whether jobs may ask for one; where nobody sends any they must not
};

/// Whom to tell of a job's end, and of which ends.
struct Webhook {
  std::string url;                                                      ///< http or https
  std::vector<std::string> events{"succeeded", "failed", "cancelled"};  ///< the states' names; each once, at least one
  bool operator==(const Webhook&) const = default;
};

/// Whether an image that was made of the same scene before will do.
enum class CacheUse {
  use,      ///< it will
  refresh,  ///< it will not, but the new one will do for others
  off,      ///< neither
};

/// The optional "job" member: how the service should treat the scene. The command line ignores it. Times are
/// milliseconds since 1970 UTC.
struct JobRequest {
  std::string name;  ///< default: the scene's name
  std::map<std::string, std::string> labels;
  int priority = 50;                         ///< 0..100, higher first
  int max_attempts = 3;                      ///< 1..10
  std::optional<std::int64_t> run_after;     ///< does not start earlier
  std::optional<std::int64_t> deadline;      ///< fails when it has not ended by then; later than run_after
  std::optional<std::int64_t> expires_in_s;  ///< its images go this long after its end, 1 s to 10 years
  CacheUse cache = CacheUse::use;
  std::optional<Webhook> webhook;
};

struct Document {
  tracer::Scene scene;  ///< passes tracer::validate; meshes of files are still to be read (api/load_assets.h)
  JobRequest job;
};

/// Why a document was refused.
struct Refusal {
  enum class Kind {
    not_json,   ///< `detail` says what, at `line` and `column` (1-based; column counts bytes). No issues.
    too_large,  ///< over a DocumentLimits bound; `detail` names the limit and the value seen. No issues.
    invalid,    ///< `issues` holds all of them, in document order; of shape and of meaning 1000 each at most, then one
                ///< "too_many_issues" with the count of the rest.
  };
  Kind kind = Kind::invalid;
  std::string detail;
  std::size_t line = 0, column = 0;
  std::vector<tracer::Issue> issues;
};

/// Time and memory are linear in `bytes` and bounded by `limits` (at the default bounds: seconds, and about 1 GB).
/// Never throws, never crashes, whatever the bytes: where memory runs out the document is `too_large`. Any thread;
/// calls share nothing.
///
/// Where `canonical` is given and the document is good, it becomes the canonical text: equal for documents that say the
/// same of the image in another order, with other blanks, escapes or spellings of numbers. The member "job" is left
/// out, the members of objects are sorted by their names' bytes, numbers are the shortest decimals that read back the
/// same double.
tracer::Result<Document, Refusal> parse_scene(std::string_view bytes, const Limits& limits,
                                              std::string* canonical = nullptr);

}  // namespace api
