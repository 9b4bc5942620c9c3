#pragma once
/// Parts of a render that are traced elsewhere: by other threads, processes or machines with the same program and an
/// equal compiled scene. Image, error estimate and statistics are bit-identical to those of one process, for any number
/// of parts that are traced elsewhere, in any order, and with repeated results.
///
/// A render samples in rounds. The samples of a round are fixed when it begins, and a PartExchange may have it divided
/// into parts, each a set of tiles. A part contains all that its samples depend on beside the scene, and its result the
/// sums of its pixels, so that merging is copying. The division and the bytes of each part depend on the scene and its
/// settings alone: results that were kept are valid for another render of the same scene.
///
///   struct Exchange : tracer::PartExchange { ... };   // hands parts to other workers
///   tracer::render(scene, {.exchange = &exchange}, control);
///   auto result = tracer::trace_part(scene, part.bytes, {}, control);   // by a worker
///
/// Bytes have the order and the types of the machine. Both ends must be of one build (tracer/version.h).

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "tracer/render.h"

namespace tracer {

struct Part {
  std::string bytes;          ///< for trace_part()
  std::uint64_t samples = 0;  ///< camera samples: the work
};

struct PartResult {
  std::size_t part = 0;  ///< index in the round
  std::string bytes;  ///< result of trace_part(). Untrusted: one that does not belong to the part is not used, and the
                      ///< part is traced again
};

/// Distributes the parts of a render. Implemented by the caller. take() and put() are called by any thread of the
/// render, the rest by the thread that called render(). Renders with a time budget use none.
class PartExchange {
 public:
  virtual ~PartExchange() = default;
  /// True to divide the next round, which has so many camera samples. Otherwise it is traced as without an exchange.
  virtual bool divides(std::uint64_t samples) = 0;
  /// Begins a round. `parts` live until the next call, or the end of the render.
  virtual void begin(std::span<const Part> parts) = 0;
  /// A part for the calling thread to trace now, or nothing while all are done or traced elsewhere. A part may be
  /// returned again, for example because another worker is late.
  virtual std::optional<std::size_t> take() = 0;
  /// Result of a part that take() returned.
  virtual void put(std::size_t part, std::string_view result) = 0;
  /// Results that were traced elsewhere, each at least once. Waits until there is one, or take() would return a part,
  /// or the render is cancelled; may also return early with nothing.
  virtual std::vector<PartResult> wait() = 0;
};

/// Traces a part of a render of `scene`. `settings`: only `threads` is used. Fails with `cancelled`, `out_of_memory`,
/// and `internal` if the part does not belong to the scene; it may come from an untrusted source.
Result<std::string, Failure> trace_part(const CompiledScene& scene, std::string_view part,
                                        const RenderSettings& settings, RenderControl& control);

}  // namespace tracer
