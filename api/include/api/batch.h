#pragma once
/// Reads batches: variations of one scene, given as merge patches or as a sweep over values.

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "api/document.h"
#include "tracer/result.h"

namespace api {

/// The body of POST /v1/batches without its scenes.
struct BatchRequest {
  std::string name;               ///< default: empty
  std::optional<int> max_failed;  ///< after more failed jobs, the others are cancelled; unset: never
  int jobs = 0;                   ///< number of documents, at least 1
};

struct BatchLimits {
  Limits document;                     ///< for the body and for each document
  int jobs = 10'000;                   ///< maximum number of documents: a night of frames
  std::size_t all_bytes = 512u << 20;  ///< sum over all documents, which are stored in one transaction
};

/// Receives each document in order: its text, its content and its canonical text (parse_scene). An exception that it
/// throws leaves parse_batch.
using TakeDocument = std::function<void(std::string document, Document parsed, std::string canonical)>;

/// Reads {"scene": document, "frames": [JSON merge patch (RFC 7396), ...]} or {"scene", "sweep": {JSON pointer: [value,
/// ...]}}, each with "name" and "max_failed". A sweep is the product of all values; those of the last pointer vary
/// fastest. The value that a pointer names may be missing, but not the object or array that contains it.
///
/// Refused as by parse_scene if any part is invalid. Then `take` may have been called for some documents, which the
/// caller must discard. Issues of a document begin with its frame ("/frames/3/camera/fov"), or with "/scene" and end
/// with the values of the sweep. Time and memory are those of parsing each document.
tracer::Result<BatchRequest, Refusal> parse_batch(std::string_view bytes, const BatchLimits& limits,
                                                  const TakeDocument& take);

}  // namespace api
