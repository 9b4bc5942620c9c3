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
#include "server/queue/previews.h"
#include "server/worker/process/measure_job.h"
#include "server/worker/process/render_job.h"
#include "tracer/encode.h"

namespace worker {
namespace {

constexpr std::chrono::milliseconds heartbeat_interval{1000};
/// Often enough for a smooth bar, seldom enough to cost nothing.
constexpr std::chrono::milliseconds progress_interval{50};
/// Of threads that large jobs run on; the worker's others have 5 (main.cpp).
constexpr int large_nice = 10;

/// Empty while there is nothing to see, or no memory for it.
std::string preview_png(JobControl& control, std::uint32_t side) {
  try {
    const std::optional<tracer::Image> image = control.preview.snapshot(side);
    if (!image || std::find(image->alpha.begin(), image->alpha.end(), 1.0f) == image->alpha.end()) return {};
    const auto png = tracer::encode(*image, tracer::Format::png, control.shown_as);
    return png ? std::string(png->begin(), png->end()) : std::string();
  } catch (const std::bad_alloc&) {
    return {};
  }
}

/// Threads that work for an arena have less of the processors from then on: those in whose way a small job would be.
/// On the fair scheduler 5 steps are a third. It cannot be taken back without privileges, and need not be.
class LowPriorityObserver : public oneapi::tbb::task_scheduler_observer {
 public:
  explicit LowPriorityObserver(oneapi::tbb::task_arena& arena) : task_scheduler_observer(arena) { observe(true); }
  ~LowPriorityObserver() override { observe(false); }
  LowPriorityObserver(const LowPriorityObserver&) = delete;
  LowPriorityObserver& operator=(const LowPriorityObserver&) = delete;
  void on_scheduler_entry(bool) override { setpriority(PRIO_PROCESS, 0, large_nice); }
};

}  // namespace

RenderExecutor::RenderExecutor(int socket, const Options& options)
    : socket_(socket), options_(options), cache_(options.scene_cache_bytes) {
  small_place_free_ = options.slots > 1;  // now: the first job may come before its thread
  for (int i = 0; i < options.slots; ++i) {
    const Place place = i == 0 && options.slots > 1 ? Place::small : Place::any;
    threads_.emplace_back([this, place] { work(place); });
  }
  threads_.emplace_back([this] { pulse(); });
}

void RenderExecutor::assign(Assign job) {
  const std::lock_guard lock(mutex_);
  jobs_.insert_or_assign(job.job_id, std::make_shared<Job>());
  if (jobs_.size() > 1) {
    for (const auto& [id, other] : jobs_) other->control.alone = false;
  }
  (small_place_free_ && !job.large ? small_came_ : job_came_).notify_one();
  waiting_.push_back(std::move(job));
  busy_.notify_one();
}

void RenderExecutor::cancel(const std::string& job_id) {
  const std::lock_guard lock(mutex_);
  const auto found = jobs_.find(job_id);
  if (found != jobs_.end()) found->second->control.tracing.cancel();
}

void RenderExecutor::look(const Look& wish) {
  const std::lock_guard lock(mutex_);
  const auto found = jobs_.find(wish.job_id);
  if (found == jobs_.end()) return;
  std::set<std::uint32_t>& looks = found->second->looks;
  if (looks.size() < queue::Previews::sides_max) looks.insert(std::clamp(wish.side, 1u, queue::preview_side_max));
}

/// Whatever kind of job it is.
Outcome RenderExecutor::done(Assign assigned, JobControl& control) {
  const auto kind = queue::job_kind(assigned.kind);
  if (kind == queue::JobKind::measure) return measure_job(assigned, options_.files, control);
  return render_job(std::move(assigned), options_.files, control, &cache_);
}

/// The oldest that may run there; the end: none. Small ones are left to the small place while it is free.
std::deque<Assign>::iterator RenderExecutor::next_for(Place place) {
  return std::find_if(waiting_.begin(), waiting_.end(), [&](const Assign& job) {
    return place == Place::small ? !job.large : job.large || !small_place_free_;
  });
}

void RenderExecutor::work(Place place) {
  oneapi::tbb::task_arena arena(options_.threads > 0 ? options_.threads : oneapi::tbb::task_arena::automatic);
  std::optional<LowPriorityObserver> step_back;
  if (place == Place::any && options_.slots > 1) step_back.emplace(arena);
  std::unique_lock lock(mutex_);
  for (;;) {
    (place == Place::small ? small_came_ : job_came_).wait(lock, [&] { return next_for(place) != waiting_.end(); });
    const auto next = next_for(place);
    Assign assigned = std::move(*next);
    waiting_.erase(next);
    if (place == Place::small) {
      small_place_free_ = false;
      if (!waiting_.empty()) job_came_.notify_all();  // who left more of them to it
    }
    const std::string id = assigned.job_id;
    const std::shared_ptr<Job> job = jobs_.at(id);
    lock.unlock();

    Outcome outcome = arena.execute([&] { return done(std::move(assigned), job->control); });
    const auto* failed = std::get_if<Failed>(&outcome);
    if (failed != nullptr && failed->problem.code == "out_of_memory") cache_.clear();  // the next attempt has it

    lock.lock();
    jobs_.erase(id);
    needs_trim_ = true;
    idle_since_ = std::chrono::steady_clock::now();
    if (place == Place::small) small_place_free_ = true;  // before anyone hears of the end and sends the next
    lock.unlock();
    std::visit([this](auto& answer) { say(std::move(answer)); }, outcome);
    lock.lock();
  }
}

void RenderExecutor::pulse() {
  auto next_heartbeat = std::chrono::steady_clock::now();
  for (;;) {
    const auto now = std::chrono::steady_clock::now();
    if (now >= next_heartbeat) {
      const tracer::SceneCache::Bytes kept = cache_.memory_bytes();
      say(Heartbeat{kept.geometry, kept.images});
      next_heartbeat = now + heartbeat_interval;
      trim_heap(now);
    }
    tell_progress();
    show_previews();
    std::unique_lock lock(mutex_);
    if (jobs_.empty()) busy_.wait_until(lock, next_heartbeat, [&] { return !jobs_.empty(); });
    lock.unlock();
    std::this_thread::sleep_for(progress_interval);
  }
}

/// What jobs have freed goes back to the machine, at most once a second: after each small job it would cost more than
/// the job.
void RenderExecutor::trim_heap(std::chrono::steady_clock::time_point now) {
  {
    const std::lock_guard lock(mutex_);
    const bool forgets = jobs_.empty() && now - idle_since_ >= std::chrono::milliseconds(options_.cache_idle_ms) &&
                         cache_.memory_bytes().all() > 0;
    if (forgets) cache_.clear();
    if (!std::exchange(needs_trim_, false) && !forgets) return;
  }
  malloc_trim(0);
}

void RenderExecutor::tell_progress() {
  std::vector<Progress> news;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [id, job] : jobs_) {
      const JobControl& control = job->control;
      const bool in_steps = control.steps_total > 0;
      const std::uint64_t done = in_steps ? control.steps_done.load() : control.tracing.tiles_done();
      const std::uint64_t total = in_steps ? control.steps_total.load() : control.tracing.tiles_total();
      if (done > job->told) news.push_back({id, done, total});
      job->told = done;
    }
  }
  for (Progress& progress : news) say(std::move(progress));
}

/// Those that were asked for, as soon as there is something to see. On this thread: some milliseconds, as often as
/// somebody asks.
void RenderExecutor::show_previews() {
  std::vector<std::pair<std::shared_ptr<Job>, Looked>> wanted;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [id, job] : jobs_) {
      for (const std::uint32_t side : job->looks) wanted.push_back({job, {id, side, {}}});
    }
  }
  for (auto& [job, looked] : wanted) {
    looked.png = preview_png(job->control, looked.side);
    if (looked.png.empty()) continue;
    {
      const std::lock_guard lock(mutex_);
      job->looks.erase(looked.side);
    }
    say(std::move(looked));
  }
}

void RenderExecutor::say(Message message) {
  const Packet packet = pack(std::move(message));
  while (send(socket_, packet) == Sent::later) std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

}  // namespace worker
