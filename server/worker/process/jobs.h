#pragma once
/// The jobs of the worker process: renders and measurements.

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <variant>

#include "server/worker/process/file_client.h"
#include "server/worker/protocol/protocol.h"
#include "tracer/compile.h"
#include "tracer/control.h"
#include "tracer/result.h"
#include "tracer/scene.h"
#include "tracer/scene_cache.h"

namespace worker {

class TaskExchange;

/// State that a running job shares with the other threads of the worker.
struct JobControl {
  tracer::RenderControl tracing;  ///< controls the image being traced; cancels the whole job
  tracer::Preview preview;        ///< used by renders
  tracer::Output display_output;  ///< for encoding the preview; set before the preview has pixels
  /// Progress of a measurement in images. A total of 0: the tiles of `tracing` count instead.
  std::atomic<std::uint64_t> steps_done{0}, steps_total{0};
  std::mutex measured_mutex;
  std::string measured;           ///< summary of a measurement so far that was not sent yet; under the mutex
  std::atomic<bool> alone{true};  ///< no other job ran in the worker meanwhile
  std::mutex exchange_mutex;
  std::shared_ptr<TaskExchange> exchange;  ///< set for a divisible job, while it is traced; under the mutex
};

/// The connection of a job to the tasks of other nodes.
struct TaskChannel {
  const std::atomic<std::int64_t>& helpers;  ///< as TaskExchange
  std::function<void(Message)> send;         ///< to the daemon
  int threads = 1;                           ///< that trace one job
};

/// Access to the files of scenes.
struct JobFiles {
  FileSettings settings;
  FileClient* client = nullptr;  ///< needed by scenes with files
};

using Outcome = std::variant<Finished, Failed, Cancelled>;

/// Parses, compiles, traces and encodes on the oneTBB arena of the calling thread. The report contains the stage times.
/// `cache` may be null. Never throws: fails as "out_of_memory", as "bad_scene" with an invalid document, as "bad_asset"
/// with all issues of its files, otherwise as "internal". The limits of `files.settings` apply to scenes with mesh
/// files, all objects included.
/// `channel`: null, or has a divisible job traced by several nodes.
Outcome render_job(Assign job, const JobFiles& files, JobControl& control, tracer::SceneCache* cache,
                   const TaskChannel* channel = nullptr) noexcept;

/// The compiled scene of a document, for tasks; null if it cannot be compiled here.
std::shared_ptr<const tracer::CompiledScene> compile_document(const std::string& document, const JobFiles& files,
                                                              tracer::SceneCache* cache) noexcept;

/// Renders the scene of an api::MeasureRequest with each value of its parameters, on the oneTBB arena of the calling
/// thread. The report is that of api::write_measurement_summary; the images are those of measurement_files.
/// Never throws: fails as render_job, and as "bad_scene" if no parameter changes anything in the scene.
Outcome measure_job(const Assign& job, const JobFiles& files, JobControl& control) noexcept;

/// The live form of a document (tracer/live.h), on the oneTBB arena of the calling thread. Never throws: fails as
/// queue::bad_scene if the scene or its files are invalid or exceed a limit of the live form.
queue::ImageTaskResult live_form(std::string document, const JobFiles& files, tracer::SceneCache* cache) noexcept;

/// Works on finished images for clients that wait and sends the result on the socket. Any thread; one task runs at a
/// time, with about `memory_bytes` at most: images with too many pixels for that are refused. Never throws.
void run_image_task(ImageTask task, std::uint64_t memory_bytes, int socket) noexcept;

/// Opens the fonts of plots before the sandbox prevents it. False if plots cannot be drawn.
bool load_fonts();

/// Loads the image library, without other threads. False if it cannot be loaded.
bool load_encoders();

}  // namespace worker
