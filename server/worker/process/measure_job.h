#pragma once
/// Runs a measurement in the worker process, from document to metrics and plot.

#include "server/worker/process/job_control.h"
#include "server/worker/process/job_stages.h"

namespace worker {

/// Renders the scene of an api::MeasureRequest with each value of its parameters, on the oneTBB arena of the calling
/// thread. The report is that of api::write_measurement_summary; the images are measure.json, .csv, .svg and .png.
/// Never throws: fails as render_job, and as "bad_scene" if no parameter changes anything in the scene.
Outcome measure_job(const Assign& job, const FileSettings& files, JobControl& control) noexcept;

/// Opens the fonts of plots before the sandbox prevents it. False if plots cannot be drawn.
bool load_fonts();

}  // namespace worker
