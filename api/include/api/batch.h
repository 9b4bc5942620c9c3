#pragma once
/// Reads batches: variations of one scene, given as merge patches or as a sweep over values.

#include <cstddef>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "api/document.h"
#include "api/estimate.h"
#include "tracer/result.h"

namespace api {

/// The body of POST /v1/batches without its variations.
struct BatchRequest {
  std::string name;               ///< default: empty
  std::optional<int> max_failed;  ///< after more failed jobs, the others are cancelled; unset: never
  int jobs = 0;                   ///< number of documents, at least 1
  std::string scene;              ///< the document that each patch changes
  std::string sweep;              ///< the JSON of "sweep"; empty without one or if it is longer than sweep_bytes_max
};

struct BatchLimits {
  Limits document;                      ///< for the body and for each document
  int jobs = 10'000;                    ///< maximum number of documents: a night of frames
  std::size_t all_bytes = 256u << 20;   ///< the scene and all patches, which are stored in one transaction
  std::size_t all_values = 20'000'000;  ///< values of all documents that are read: some seconds
};

/// Differences of longer JSON are not kept with their jobs.
inline constexpr std::size_t variation_bytes_max = 4096;

inline constexpr std::size_t sweep_bytes_max = 16384;

/// One document of a batch.
struct Frame {
  std::string patch;  ///< see apply_patch
  /// The difference from the scene for people and programs: the merge patch, or an object from the pointers of the
  /// sweep to the values; as JSON, empty if it is too long.
  std::string variation;
  Document document;     ///< as patched, but complete only if `complete`
  Digests digests;       ///< those of the complete document
  SceneContent content;  ///< that of the complete document
  /// False: `document` lacks members that the patch does not change, among them all objects and materials. Its files
  /// are those of the complete documents before it.
  bool complete = true;
};

/// Receives each document in order. An exception that it throws leaves parse_batch.
using TakeFrame = std::function<void(Frame)>;

/// Reads {"scene": document, "frames": [JSON merge patch (RFC 7396), ...]} or {"scene", "sweep": {JSON pointer: [value,
/// ...]}}, each with "name" and "max_failed". A sweep is the product of all values; those of the last pointer vary
/// fastest. The value that a pointer names may be missing, but not the object or array that contains it.
///
/// Refused as by parse_scene if any part is invalid. Then `take` may have been called for some documents, which the
/// caller must discard. Issues of a document begin with its frame ("/frames/3/camera/fov"), or with "/scene" and end
/// with the values of the sweep.
///
/// Time is that of parsing the body and one complete document, and for each further document the members that its patch
/// changes; but the complete document again if the patch changes textures, materials, prototypes, objects or the
/// background, because they depend on each other. Memory is that of the body and of one document.
tracer::Result<BatchRequest, Refusal> parse_batch(std::string_view bytes, const BatchLimits& limits,
                                                  const TakeFrame& take);

/// The document that a patch makes of a scene: a merge patch (RFC 7396) if it is an object; if it is an array a JSON
/// patch (RFC 6902) that adds members and replaces members and elements. None if one of them is not JSON or the patch
/// does not apply.
std::optional<std::string> apply_patch(std::string_view scene, std::string_view patch);

}  // namespace api
