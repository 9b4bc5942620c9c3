#pragma once
/// What a job that runs and the worker's other threads tell each other.

#include <atomic>
#include <cstdint>

#include "tracer/control.h"
#include "tracer/preview.h"
#include "tracer/scene.h"

namespace worker {

struct JobControl {
  tracer::RenderControl tracing;  ///< of the image that is traced now; cancels all of the job
  tracer::Preview preview;        ///< of a render
  tracer::Output shown_as;        ///< how a look at it becomes an image; written before there is anything to look at
  /// Of a measurement, which is many images: those done and to be done. 0 of 0: the tiles of `tracing` count.
  std::atomic<std::uint64_t> steps_done{0}, steps_total{0};
  std::atomic<bool> alone{true};  ///< no other job was in the worker meanwhile
};

}  // namespace worker
