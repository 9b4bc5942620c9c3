#pragma once
/// One job in the worker process, from document to pictures.

#include <variant>

#include "server/worker/options.h"
#include "server/worker/protocol.h"
#include "tracer/control.h"
#include "tracer/geometry_cache.h"

namespace worker {

using Outcome = std::variant<Finished, Failed, Cancelled>;

/// Reads, compiles, traces and encodes on the calling thread's oneTBB arena; `control` tells tiles and cancels. Stage
/// times in the report are measured here. Never throws: no memory is Failed "out_of_memory", a document that cannot be
/// read "bad_scene", files that cannot be rendered with "bad_asset" with all issues, everything else that goes wrong
/// "internal".
/// The document's limits were checked by whoever accepted it, and are not checked again: they may have changed since.
/// Those of `files` hold for scenes with meshes of files, the other objects counted with theirs.
/// `geometry` may be null.
Outcome render_job(Assign job, const FileSettings& files, tracer::RenderControl& control,
                   tracer::GeometryCache* geometry) noexcept;

}  // namespace worker
