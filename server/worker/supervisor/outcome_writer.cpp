#include "server/worker/supervisor/outcome_writer.h"

#include <memory>
#include <utility>
#include <vector>

namespace worker {
namespace {

queue::Problem storage_failure(const queue::StoreFailure& failure) {
  const bool full = failure.kind == queue::StoreFailure::Kind::full;
  return {"storage_failure",
          std::string("The image was rendered but could not be stored: ") +
              (full ? "the disk is full." : "the store is not available."),
          {}};
}

}  // namespace

// ---- StoreExecutor

std::optional<queue::StoreFailure> StoreExecutor::run_with_retry(int tries, std::string_view operation,
                                                                 const std::function<void()>& call) {
  for (int tried = 1;; ++tried) {
    std::optional<queue::StoreFailure> failure;
    try {
      call();
      return std::nullopt;
    } catch (const queue::StoreFailure& thrown) {
      failure = thrown;
    } catch (const std::exception& thrown) {  // no memory or descriptors
      failure.emplace(queue::StoreFailure::Kind::unavailable, thrown.what());
    }
    log_(queue::LogLevel::error, "store_failure", {{"during", std::string(operation)}, {"detail", failure->what()}});
    const bool broken = failure->kind == queue::StoreFailure::Kind::broken;
    if (broken || tried == tries || !pause()) return failure;
  }
}

void StoreExecutor::stop_retrying() {
  const std::lock_guard lock(mutex_);
  retrying_ = false;
  retrying_stopped_.notify_all();
}

bool StoreExecutor::pause() {
  std::unique_lock lock(mutex_);
  return !retrying_stopped_.wait_for(lock, pause_, [&] { return !retrying_; });
}

// ---- OutcomeWriter

OutcomeWriter::OutcomeWriter(queue::Queue& queue, StoreExecutor& executor, LoopEvents& events,
                             const SupervisorSettings& settings, const queue::Log& log)
    : queue_(queue),
      executor_(executor),
      events_(events),
      store_tries_(settings.store_tries),
      log_(log),
      backlog_(
          settings, [this](const Finished& finished) { store(finished); }, [this] { events_.interrupt(); }, log) {}

void OutcomeWriter::run(std::function<void()> task, std::function<void()> on_done) {
  ++pending_;
  executor_.run([this, task = std::move(task), on_done = std::move(on_done)]() mutable {
    task();
    events_.post([this, on_done = std::move(on_done)] {
      --pending_;
      on_done();
    });
  });
}

void OutcomeWriter::succeed(Finished finished, std::function<void(const queue::Problem&)> on_failure) {
  const auto shared = std::make_shared<Finished>(std::move(finished));  // a std::function has to be copyable
  run([this, shared, on_failure = std::move(on_failure)] {
    const bool may_wait = store_tries_ == 0;
    if (may_wait && backlog_.size() > 0) return backlog_.add(std::move(*shared));  // the store is away
    const auto failure = executor_.run_with_retry(may_wait ? 1 : store_tries_, "succeed", [&] { store(*shared); });
    // After a disk failure the next start finds the job running and releases it at no cost.
    if (!failure || failure->kind == queue::StoreFailure::Kind::broken) return;
    if (may_wait) return backlog_.add(std::move(*shared));
    events_.post([on_failure, problem = storage_failure(*failure)] { on_failure(problem); });
  });
}

void OutcomeWriter::store(const Finished& finished) {
  std::vector<queue::JobLifecycle::Image> images;
  for (const Image& image : finished.images) images.push_back({image.name, image.media_type, image.bytes.get()});
  log_outcome("job_succeeded", finished.job_id,
              queue_.lifecycle.succeed(finished.job_id, finished.fence, finished.report, images, finished.figures));
}

void OutcomeWriter::fail(const std::string& id, std::int64_t fence, const queue::Problem& problem) {
  run([this, id, fence, problem] {
    executor_.run_with_retry(0, "fail", [&] {
      log_outcome("job_failed", id, queue_.lifecycle.fail(id, fence, problem), {{"code", problem.code}});
    });
  });
}

void OutcomeWriter::cancel(const std::string& id, std::int64_t fence) {
  run([this, id, fence] {
    executor_.run_with_retry(0, "cancel",
                             [&] { log_outcome("job_cancelled", id, queue_.lifecycle.finish_cancel(id, fence)); });
  });
}

void OutcomeWriter::keep_preview(const std::string& id, std::int64_t fence, std::string png) {
  run([this, id, fence, png = std::move(png)] {
    const auto keep = [&] {
      const Descriptor memory = sealed_memory(png);
      if (queue_.lifecycle.keep_preview(id, fence, memory.get())) return;
      // Another thread writes the end at present, or the job runs again.
      throw queue::StoreFailure("the job has not ended");
    };
    executor_.run_with_retry(3, "keep_preview", keep);
  });
}

void OutcomeWriter::release(const std::string& id, std::int64_t fence, const queue::Release& release,
                            std::function<void()> on_released) {
  const auto task = [this, id, fence, release] {
    executor_.run_with_retry(0, "release",
                             [&] { log_outcome("job_released", id, queue_.lifecycle.release(id, fence, release)); });
  };
  run(task, std::move(on_released));
}

void OutcomeWriter::log_outcome(const char* event, const std::string& id, bool moved, queue::LogFields fields) {
  if (!moved) return;
  fields.emplace_back("job_id", id);
  log_(queue::LogLevel::info, event, fields);
}

}  // namespace worker
