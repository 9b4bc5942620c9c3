#pragma once
/// Stages that renders and measurements share: parsing the document, loading its files, translating errors.

#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "api/document.h"
#include "server/worker/protocol/protocol.h"
#include "server/worker/protocol/worker_options.h"
#include "tracer/assets.h"
#include "tracer/compile.h"
#include "tracer/control.h"
#include "tracer/result.h"

namespace worker {

using Outcome = std::variant<Finished, Failed, Cancelled>;

/// Thrown to leave a stage; caught only by outcome_of.
struct Stop {
  std::optional<queue::Problem> problem;  ///< none: the job was cancelled
};

/// The result of `work`, or its exception as an answer: std::bad_alloc is "out_of_memory", an unexpected one
/// "internal".
Outcome outcome_of(const std::string& job_id, std::int64_t fence, const std::function<Finished()>& work) noexcept;

/// No limits on the document: they were checked when it was accepted, and may have changed since.
api::Limits reading_limits(const FileSettings& files);

/// Content identifiers of the files of `scene`, in their order, for tracer::SceneCache.
std::vector<std::string> content_names(const tracer::Scene& scene, const FileSettings& files);

/// Leaves the stage if the job is cancelled.
inline void stop_if_cancelled(const tracer::RenderControl& control) {
  if (control.cancelled()) throw Stop{};
}

/// Loads the files of `scene`. Stops as "bad_asset" with all issues if they are invalid, and between files if the job
/// is cancelled.
tracer::Assets load_files(tracer::Scene& scene, const FileSettings& files, const tracer::RenderControl& control);

[[noreturn]] void stop_for(const api::Refusal& refusal);  ///< "bad_scene"
[[noreturn]] void stop_for(const tracer::Failure& failure);

template <class T>
T value_of(tracer::Result<T, tracer::Failure> result) {
  if (!result) stop_for(result.error());
  return *std::move(result);
}

}  // namespace worker
