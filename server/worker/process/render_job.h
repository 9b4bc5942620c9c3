#pragma once
/// One job in the worker process, from document to images.

#include "server/worker/process/job_control.h"
#include "server/worker/process/job_stages.h"
#include "tracer/scene_cache.h"

namespace worker {

/// Reads, compiles, traces and encodes on the calling thread's oneTBB arena; `control` tells tiles and cancels. Stage
/// times in the report are measured here. Never throws: no memory is Failed "out_of_memory", a document that cannot be
/// read "bad_scene", files that cannot be rendered with "bad_asset" with all issues, everything else that goes wrong
/// "internal".
/// Those of `files` hold for scenes with meshes of files, the other objects counted with theirs.
/// `cache` may be null.
Outcome render_job(Assign job, const FileSettings& files, JobControl& control, tracer::SceneCache* cache) noexcept;

}  // namespace worker
