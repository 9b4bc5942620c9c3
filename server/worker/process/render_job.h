#pragma once
/// Renders one job in the worker process, from document to images.

#include "server/worker/process/job_control.h"
#include "server/worker/process/job_stages.h"
#include "tracer/scene_cache.h"

namespace worker {

/// Parses, compiles, traces and encodes on the oneTBB arena of the calling thread. The report contains the stage times.
/// `cache` may be null. Never throws: fails as "out_of_memory", as "bad_scene" with an invalid document, as "bad_asset"
/// with all issues of its files, otherwise as "internal". The limits of `files` apply to scenes with mesh files, all
/// objects included.
Outcome render_job(Assign job, const FileSettings& files, JobControl& control, tracer::SceneCache* cache) noexcept;

}  // namespace worker
