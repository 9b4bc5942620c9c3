#pragma once
/// State that a running job shares with the other threads of the worker.

#include <atomic>
#include <cstdint>

#include "tracer/control.h"
#include "tracer/preview.h"
#include "tracer/scene.h"

namespace worker {

struct JobControl {
  tracer::RenderControl tracing;  ///< of the image being traced; cancels the whole job
  tracer::Preview preview;        ///< of a render
  tracer::Output display_output;  ///< for encoding the preview; set before the preview has pixels
  /// Images of a measurement. A total of 0: the tiles of `tracing` count instead.
  std::atomic<std::uint64_t> steps_done{0}, steps_total{0};
  std::atomic<bool> alone{true};  ///< no other job ran in the worker meanwhile
};

}  // namespace worker
