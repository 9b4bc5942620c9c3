#pragma once
/// Reads batches: one scene in many variations, as merge patches or as a sweep over values.

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "api/document.h"
#include "tracer/result.h"

namespace api {

/// The body of POST /v1/batches but for its scenes.
struct BatchRequest {
  std::string name;  ///< default: empty
  /// With more failed jobs than this the rest is cancelled. Unset: never.
  std::optional<int> max_failed;
  int jobs = 0;  ///< how many documents there were, at least 1
};

struct BatchLimits {
  Limits document;                     ///< of the body as a whole and of each document in it
  int jobs = 10'000;                   ///< most documents: a night of frames
  std::size_t all_bytes = 512u << 20;  ///< of all documents together: they are stored in one transaction
};

/// Called for each document, in order: its text, what it says, and its canonical text (parse_scene). What it throws
/// passes through.
using TakeDocument = std::function<void(std::string document, Document parsed, std::string canonical)>;

/// {"scene": document, "frames": [JSON merge patch (RFC 7396), ...]} or {"scene", "sweep": {JSON pointer: [value,
/// ...]}}, each with "name" and "max_failed". A sweep is all combinations, the values of the pointer written last
/// turning fastest; what a pointer names need not be there, but what is around it must.
///
/// Refused as parse_scene does, when anything of it is wrong: then `take` may have been called for some documents,
/// which must be forgotten. Issues of a document begin with the place of its frame ("/frames/3/camera/fov"), or with
/// "/scene" and say for which values. Time and memory are those of parsing each document.
tracer::Result<BatchRequest, Refusal> parse_batch(std::string_view bytes, const BatchLimits& limits,
                                                  const TakeDocument& take);

}  // namespace api
