#pragma once
/// What renders and measurements have in common: a document is read, its files are loaded, and what goes wrong becomes
/// the answer.

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

/// Thrown to leave a stage; caught by outcome_of alone.
struct Stop {
  std::optional<queue::Problem> problem;  ///< nothing: it was cancelled
};

/// What `work` comes to. Whatever it throws is an answer too: no memory is Failed "out_of_memory", what is none of ours
/// "internal".
Outcome outcome_of(const std::string& job_id, std::int64_t fence, const std::function<Finished()>& work) noexcept;

/// The document's limits were checked by whoever accepted it, and are not checked again: they may have changed since.
api::Limits reading_limits(const FileSettings& files);

/// Names for the content of the files that `scene` names, beside them, for tracer::SceneCache.
std::vector<std::string> content_names(const tracer::Scene& scene, const FileSettings& files);

/// Leaves the stage where the job was cancelled.
inline void stop_if_cancelled(const tracer::RenderControl& control) {
  if (control.cancelled()) throw Stop{};
}

/// The files that `scene` names. Stops as "bad_asset" with all issues where they cannot be rendered with, and between
/// files where the job was cancelled.
tracer::Assets load_files(tracer::Scene& scene, const FileSettings& files, const tracer::RenderControl& control);

[[noreturn]] void stop_for(const api::Refusal& refusal);  ///< "bad_scene"
[[noreturn]] void stop_for(const tracer::Failure& failure);

template <class T>
T value_of(tracer::Result<T, tracer::Failure> result) {
  if (!result) stop_for(result.error());
  return *std::move(result);
}

}  // namespace worker
