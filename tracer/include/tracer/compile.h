#pragma once
/// Turns a scene into what rays can be traced against: recentred, scaled by a power of two, with its BVH built.

#include <cstdint>
#include <memory>
#include <string>

#include "tracer/control.h"
#include "tracer/result.h"
#include "tracer/scene.h"

namespace tracer {

/// Immutable; any number of renders on any threads may share one. Opaque: its content is the tracer's business.
class CompiledScene;

/// Why a compile or render gave nothing.
struct Failure {
  enum class Code { cancelled, out_of_memory, internal };
  Code code = Code::internal;
  std::string detail;  ///< a sentence for people
};

/// Precondition: `validate` found nothing. Expensive, done once; keeps no reference to `scene`.
/// Fails with `cancelled` when `control` says so, `out_of_memory` when Embree or the heap do.
/// Runs on the calling thread's oneTBB arena.
Result<std::shared_ptr<const CompiledScene>, Failure> compile(const Scene& scene, RenderControl& control);

/// Bytes held by the compiled scene, BVH included.
std::uint64_t memory_bytes(const CompiledScene& scene);

}  // namespace tracer
