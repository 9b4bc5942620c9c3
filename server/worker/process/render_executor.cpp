#include "server/worker/process/render_executor.h"

#include <malloc.h>
#include <oneapi/tbb/task_arena.h>
#include <oneapi/tbb/task_scheduler_observer.h>
#include <sys/resource.h>

#include <algorithm>
#include <new>
#include <optional>
#include <utility>

#include "server/queue/job.h"
#include "server/queue/job_waiters.h"
#include "server/support/locked.h"
#include "server/worker/process/jobs.h"
#include "tracer/encode.h"

namespace worker {
namespace {

constexpr std::chrono::milliseconds heartbeat_interval{1000};
constexpr std::chrono::milliseconds progress_interval{50};
constexpr int nice_max = 19;  // sched(7)

int arena_threads(const Options& options) {
  return options.threads > 0 ? options.threads : oneapi::tbb::task_arena::automatic;
}

std::optional<tracer::Image> snapshot(JobControl& control, std::uint32_t side) {
  try {
    return control.preview.snapshot(side);
  } catch (const std::bad_alloc&) {
    return std::nullopt;
  }
}

/// Empty without any pixel or memory.
std::string preview_png(const JobControl& control, const std::optional<tracer::Image>& image) {
  try {
    if (!image || std::ranges::find(image->alpha, 1.0f) == image->alpha.end()) return {};
    const auto png = tracer::encode(*image, tracer::Format::png, control.display_output);
    return png ? std::string(png->bytes.begin(), png->bytes.end()) : std::string();
  } catch (const std::bad_alloc&) {
    return {};
  }
}

/// Lowers the priority of every thread that works for an arena, so that small jobs do not wait for it: 5 nice levels
/// are a third of the processor share. Raising it again needs privileges.
class LowPriorityObserver : public oneapi::tbb::task_scheduler_observer {
 public:
  LowPriorityObserver(oneapi::tbb::task_arena& arena, int worker_nice)
      : task_scheduler_observer(arena), nice_(std::min(worker_nice + 5, nice_max)) {
    observe(true);
  }
  ~LowPriorityObserver() override { observe(false); }
  LowPriorityObserver(LowPriorityObserver&&) = delete;
  void on_scheduler_entry(bool) override { setpriority(PRIO_PROCESS, 0, nice_); }

 private:
  const int nice_;
};

}  // namespace

RenderExecutor::RenderExecutor(int socket, const Options& options, FileClient& file_client, int nice_level)
    : socket_(socket),
      options_(options),
      nice_level_(nice_level),
      files_{options.files, &file_client},
      cache_(options.scene_cache_bytes),
      channel_{helpers_, [this](Message message) { send_when_possible(socket_, std::move(message)); },
               options.thread_count()},
      task_tracer_(files_, cache_) {
  for (int i = 0; i < options.slots; ++i) threads_.emplace_back([this] { run_waiting_jobs(); });
  threads_.emplace_back([this] { heartbeat_loop(); });
}

void RenderExecutor::assign(Assign assigned) {
  const std::lock_guard lock(mutex_);
  jobs_.insert_or_assign(assigned.job_id, std::make_shared<Job>());
  if (jobs_.size() > 1) {
    for (const auto& [id, job] : jobs_) job->control.alone = false;
  }
  busy_.notify_one();
  if (assigned.large && options_.slots > 1) {
    std::thread([this, assigned = std::move(assigned)]() mutable { run_large_job(std::move(assigned)); }).detach();
    return;
  }
  waiting_jobs_.push_back(std::move(assigned));
  job_available_.notify_one();
}

std::shared_ptr<RenderExecutor::Job> RenderExecutor::find(const std::string& id) {
  const std::lock_guard lock(mutex_);
  const auto found = jobs_.find(id);
  return found == jobs_.end() ? nullptr : found->second;
}

void RenderExecutor::cancel(const Cancel& message) {
  const std::shared_ptr<Job> job = find(message.job_id);
  if (!job) return;
  const std::lock_guard sending(job->last_preview);
  std::optional<tracer::Image> last;  // from before the render stops, because its pixels are then gone
  if (message.preview) last = snapshot(job->control, queue::last_preview_side);
  job->control.tracing.cancel();
  std::string png = preview_png(job->control, last);
  if (!png.empty())
    send_when_possible(socket_, PreviewResponse{message.job_id, queue::last_preview_side, std::move(png)});
}

void RenderExecutor::request_preview(const PreviewRequest& request) {
  const std::lock_guard lock(mutex_);
  const auto found = jobs_.find(request.job_id);
  if (found == jobs_.end()) return;
  std::set<std::uint32_t>& sides = found->second->preview_sides;
  if (sides.size() < queue::Previews::sides_max) sides.insert(std::clamp(request.side, 1u, queue::preview_side_max));
}

void RenderExecutor::trace_task(TraceTask task) {
  std::thread([this, task = std::move(task)] {
    oneapi::tbb::task_arena arena(arena_threads(options_));
    TaskTraced traced;
    {
      const LowPriorityObserver observer(arena, nice_level_);
      arena.execute([&] { traced = task_tracer_.trace(task); });
    }
    send_when_possible(socket_, std::move(traced));
  }).detach();
}

void RenderExecutor::make_live_form(ImageTask task) {
  std::thread([this, task = std::move(task)]() mutable {
    ImageTaskResult message{task.number, {}};
    {
      const std::lock_guard one_at_a_time(live_mutex_);
      oneapi::tbb::task_arena arena(arena_threads(options_));
      arena.execute([&] { message.result = live_form(std::move(task.work.document), files_, &cache_); });
    }
    send_when_possible(socket_, std::move(message));
    const std::lock_guard lock(mutex_);
    needs_trim_ = true;
    idle_since_ = std::chrono::steady_clock::now();
  }).detach();
}

std::shared_ptr<TaskExchange> RenderExecutor::exchange_of(const std::string& job_id) {
  const std::shared_ptr<Job> job = find(job_id);
  if (!job) return nullptr;
  const std::lock_guard lock(job->control.exchange_mutex);
  return job->control.exchange;
}

void RenderExecutor::on_task_taken(const TaskTaken& message) {
  if (const auto exchange = exchange_of(message.job_id)) exchange->on_taken(message);
}

void RenderExecutor::on_task_done(TaskDone message) {
  if (const auto exchange = exchange_of(message.job_id)) exchange->on_done(std::move(message));
}

void RenderExecutor::run_waiting_jobs() {
  oneapi::tbb::task_arena arena(arena_threads(options_));
  std::unique_lock lock(mutex_);
  for (;;) {
    job_available_.wait(lock, [&] { return !waiting_jobs_.empty(); });
    Assign assigned = std::move(waiting_jobs_.front());
    waiting_jobs_.pop_front();
    lock.unlock();
    arena.execute([&] { run_job(std::move(assigned)); });
    lock.lock();
  }
}

void RenderExecutor::run_large_job(Assign assigned) {
  oneapi::tbb::task_arena arena(arena_threads(options_));
  const LowPriorityObserver observer(arena, nice_level_);
  arena.execute([&] { run_job(std::move(assigned)); });
}

void RenderExecutor::run_job(Assign assigned) {
  const std::string id = assigned.job_id;
  const std::shared_ptr<Job> job = find(id);
  const TaskChannel* const channel = assigned.divisible ? &channel_ : nullptr;
  Outcome outcome = queue::job_kind(assigned.kind) == queue::JobKind::measure
                        ? measure_job(assigned, files_, job->control)
                        : render_job(std::move(assigned), files_, job->control, &cache_, channel);
  const auto* failed = std::get_if<Failed>(&outcome);
  if (failed != nullptr && failed->problem.code == "out_of_memory") cache_.clear();  // memory for the next attempt
  {
    const std::lock_guard lock(mutex_);
    jobs_.erase(id);
    needs_trim_ = true;
    idle_since_ = std::chrono::steady_clock::now();
  }
  const std::lock_guard sent(job->last_preview);
  std::visit([this](auto& answer) { send_when_possible(socket_, std::move(answer)); }, outcome);
}

void RenderExecutor::heartbeat_loop() {
  auto next_heartbeat = std::chrono::steady_clock::now();
  for (;;) {
    const auto now = std::chrono::steady_clock::now();
    if (now >= next_heartbeat) {
      const tracer::SceneCache::Bytes cached = cache_.memory_bytes();
      send_when_possible(socket_, Heartbeat{cached.geometry, cached.images});
      next_heartbeat = now + heartbeat_interval;
      trim_heap(now);
    }
    send_progress();
    send_previews();
    std::unique_lock lock(mutex_);
    if (jobs_.empty()) busy_.wait_until(lock, next_heartbeat, [&] { return !jobs_.empty(); });
    lock.unlock();
    std::this_thread::sleep_for(progress_interval);
  }
}

/// Returns freed memory to the system, at most once a second: after each small job it would cost more than the job.
void RenderExecutor::trim_heap(std::chrono::steady_clock::time_point now) {
  task_tracer_.drop_idle_scenes();
  {
    const std::lock_guard lock(mutex_);
    const bool clears = jobs_.empty() && now - idle_since_ >= std::chrono::milliseconds(options_.cache_idle_ms) &&
                        cache_.memory_bytes().all() > 0;
    if (clears) cache_.clear();
    if (!std::exchange(needs_trim_, false) && !clears) return;
  }
  malloc_trim(0);
}

void RenderExecutor::send_progress() {
  std::vector<Message> messages;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [id, job] : jobs_) {
      const JobControl& control = job->control;
      const bool in_steps = control.steps_total > 0;
      constexpr std::uint64_t parts = 10'000;
      const std::uint64_t done =
          in_steps ? control.steps_done.load() : static_cast<std::uint64_t>(parts * control.tracing.progress());
      const std::uint64_t total = in_steps ? control.steps_total.load() : parts;
      if (done > job->sent_progress) messages.emplace_back(Progress{id, done, total});
      job->sent_progress = std::max(job->sent_progress, done);
      const std::lock_guard measured_lock(job->control.measured_mutex);
      std::string summary = std::exchange(job->control.measured, {});
      if (!summary.empty()) messages.emplace_back(MeasurementUpdate{id, std::move(summary)});
    }
  }
  for (Message& message : messages) send_when_possible(socket_, std::move(message));
}

/// Encodes previews on this thread, which takes some milliseconds for each request.
void RenderExecutor::send_previews() {
  std::vector<std::pair<std::shared_ptr<Job>, PreviewResponse>> pending;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [id, job] : jobs_) {
      for (const std::uint32_t side : job->preview_sides) pending.push_back({job, {id, side, {}}});
    }
  }
  for (auto& [job, response] : pending) {
    response.png = preview_png(job->control, snapshot(job->control, response.side));
    if (response.png.empty()) continue;
    support::locked(mutex_, [&] { job->preview_sides.erase(response.side); });
    send_when_possible(socket_, std::move(response));
  }
}

}  // namespace worker
