#pragma once
/// One measurement in the worker process, from document to figures and chart.

#include "server/worker/process/job_control.h"
#include "server/worker/process/job_stages.h"

namespace worker {

/// Renders the scene of an api::MeasureRequest along its parameters, on the calling thread's oneTBB arena. The answer's
/// report is api::write_measurement_summary's; its images are measure.json, .csv, .svg and .png. Never throws: fails
/// as render_job does, and as "bad_scene" where no parameter asked for changes anything in the scene.
Outcome measure_job(const Assign& job, const FileSettings& files, JobControl& control) noexcept;

/// Charts have letters: finds and opens the fonts for them, which the sandbox keeps from being found later. False where
/// no chart can be drawn.
bool load_fonts();

}  // namespace worker
