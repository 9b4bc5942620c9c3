#include "server/worker/supervisor/task_dispatcher.h"

#include <algorithm>
#include <exception>
#include <optional>
#include <string_view>

namespace worker {
namespace {

constexpr std::chrono::seconds second{1};  ///< between two looks at the tables, in case a message was lost
/// Messages, whose id is that of the job.
constexpr std::string_view tasks_published = "tasks_published", task_result = "task_result";
constexpr std::size_t excluded_max = 100;
constexpr std::uint64_t published_bytes_max = 4ull << 30;  // the worker publishes at most 1 GB

std::string joined(const std::set<std::string>& ids) {
  std::string text;
  for (const std::string& id : ids) text += id + ' ';
  return text;
}

}  // namespace

/// One task more than threads, so that the next one is here when one ends.
TaskDispatcher::TaskDispatcher(queue::Queue& queue, const SupervisorSettings& settings, StoreExecutor& executor,
                               LoopEvents& events, WorkerProcess& process, const JobDispatcher& jobs, queue::Log log)
    : queue_(queue),
      store_(settings.tasks),
      wakeups_(settings.wakeups),
      executor_(executor),
      events_(events),
      process_(process),
      jobs_(jobs),
      log_(std::move(log)),
      helping_max_(static_cast<std::size_t>(settings.thread_count()) + 1) {
  if (store_ == nullptr) return;
  const auto call_on_loop = [this](auto call) {
    return [this, call](const std::string& job_id) { events_.post([call, job_id] { call(job_id); }); };
  };
  subscriptions_.push_back(
      wakeups_->subscribe(std::string(tasks_published), call_on_loop([this](const std::string&) { next_.help = {}; })));
  subscriptions_.push_back(
      wakeups_->subscribe(std::string(task_result), call_on_loop([this](const std::string& job_id) {
                            if (job_id.empty() || awaited_.contains(job_id)) next_.read = {};
                          })));
}

template <class Call, class Done>
void TaskDispatcher::call_store(const char* operation, Call call, Done done) {
  ++pending_;
  executor_.run([this, operation, call = std::move(call), done = std::move(done)] {
    std::optional<std::invoke_result_t<Call>> result;
    try {
      result.emplace(call());
    } catch (const std::exception& failure) {
      log_(queue::LogLevel::error, "store_failure", {{"during", operation}, {"detail", failure.what()}});
    }
    events_.post([this, done, result = std::move(result)]() mutable {
      --pending_;
      done(std::move(result));
    });
  });
}

void TaskDispatcher::call_store(const char* operation, std::function<void()> call) {
  auto returning = [call = std::move(call)] {
    call();
    return true;
  };
  call_store(operation, std::move(returning), [](std::optional<bool>) {});
}

void TaskDispatcher::run(Time now, bool draining) {
  if (store_ == nullptr || process_.state() != WorkerState::ready) return;
  std::erase_if(awaited_, [&](const auto& job) { return !jobs_.runs(job.first); });
  release_unused_claims();
  if (!awaited_.empty() && !reading_ && now >= next_.read) read_results();
  if (!draining && can_help() && !claiming_ && now >= next_.help) help();
  if (now < next_.second) return;
  next_.second = now + second;
  if (jobs_.running() > 0) count_helpers();
  if (!helping_.empty() || !own_.empty()) call_store("renew_tasks", [this] { store_->renew(); });
  if (!draining && can_help()) call_store("register_helper", [this] { store_->register_helper(); });
}

/// Claims for jobs that have ended here, and may run elsewhere.
void TaskDispatcher::release_unused_claims() {
  std::erase_if(own_, [&](const auto& claim) {
    if (jobs_.runs(claim.first.first)) return false;
    release(claim.second);
    return true;
  });
}

void TaskDispatcher::release(const queue::TaskClaim& claim) {
  call_store("release_task", [this, claim] { store_->release(claim); });
}

Time TaskDispatcher::next() const {
  if (store_ == nullptr || process_.state() != WorkerState::ready) return Time::max();
  Time next = next_.second;
  if (!awaited_.empty() && !reading_) next = std::min(next, next_.read);
  if (can_help() && !claiming_) next = std::min(next, next_.help);
  return next;
}

// ---- jobs that run here

void TaskDispatcher::count_helpers() {
  const auto count = [this] { return store_->helpers(); };
  call_store("count_helpers", count, [this](std::optional<int> helpers) {
    if (helpers) process_.send(pack(Helpers{*helpers}));
  });
}

void TaskDispatcher::publish(PublishTasks& message) {
  DividedJob& job = awaited_[message.job_id];
  for (const queue::NewTask& task : message.tasks) {
    job.keys.insert(task.key);
    job.bytes += task.part.size();
  }
  if (job.bytes > published_bytes_max) return process_.end("published too many tasks", false);
  call_store("publish_tasks", [this, published = std::move(message)] {
    executor_.run_with_retry(0, "publish_tasks", [&] { store_->publish(published.job_id, published.tasks); });
    wakeups_->publish(tasks_published, published.job_id);
  });
}

void TaskDispatcher::take(const std::string& job_id) {
  const auto take = [this, job_id] { return store_->claim_own(job_id); };
  call_store("take_task", take, [this, job_id](const std::optional<std::optional<queue::TaskClaim>>& taken) {
    const auto claim = taken.value_or(std::nullopt);
    if (claim) own_.insert_or_assign({job_id, claim->key}, *claim);
    process_.send(pack(claim ? TaskTaken{job_id, claim->key, claim->attempt} : TaskTaken{job_id, {}}));
  });
}

void TaskDispatcher::read_results() {
  reading_ = true;
  next_.read = Time::clock::now() + second;                      // a message that comes while it reads shortens it
  const auto found = std::make_shared<std::vector<TaskDone>>();  // also what was read before a failure
  auto read = [this, found, awaited = awaited_] {
    for (const auto& [job_id, job] : awaited) {
      for (const std::string& key : store_->finished(job_id)) {
        if (!job.keys.contains(key)) continue;
        if (auto outcome = store_->outcome(job_id, key))
          found->push_back({job_id, key, std::move(outcome->node), outcome->attempt, std::move(outcome->result)});
      }
    }
    return true;
  };
  call_store("read_results", std::move(read), [this, found](std::optional<bool> all) {
    reading_ = false;
    if (!all) next_.read = Time::clock::now() + second;
    for (TaskDone& result : *found) {
      const auto job = awaited_.find(result.job_id);
      if (job != awaited_.end() && job->second.keys.erase(result.key) > 0) process_.send(pack(std::move(result)));
    }
  });
}

// ---- messages of the worker

void TaskDispatcher::on_message(Message& message) {
  if (store_ == nullptr) return;
  if (auto* published = std::get_if<PublishTasks>(&message)) {
    if (jobs_.runs(published->job_id)) publish(*published);
  } else if (const auto* wanted = std::get_if<TakeTask>(&message)) {
    if (jobs_.runs(wanted->job_id)) take(wanted->job_id);
  } else if (auto* traced = std::get_if<TaskTraced>(&message)) {
    on_traced(*traced);
  }
}

void TaskDispatcher::on_traced(TaskTraced& message) {
  const Key key{message.job_id, message.key};
  auto claim = own_.extract(key);
  const bool own = !claim.empty();
  if (own) {
    awaited_[message.job_id].keys.erase(message.key);
  } else {
    claim = helping_.extract(key);
    if (claim.empty()) return;  // the job has ended
    next_.help = {};
  }
  if (message.failed && !own) {
    if (excluded_.size() >= excluded_max) excluded_.clear();
    excluded_.insert(message.job_id);
    log_(queue::LogLevel::warning, "task_not_traced", {{"job_id", message.job_id}});
  }
  call_store("finish_task", [this, own, claimed = claim.mapped(), traced = std::move(message)] {
    if (traced.failed) {
      store_->release(claimed);
    } else if (store_->finish(claimed, traced.result) && !own) {
      wakeups_->publish(task_result, claimed.job_id);
    }
  });
}

// ---- tasks of other nodes

/// Jobs come first: while one runs, its threads are all of this node's.
bool TaskDispatcher::can_help() const {
  return store_ != nullptr && process_.state() == WorkerState::ready && jobs_.running() == 0 && jobs_.none_wait() &&
         helping_.size() < helping_max_;
}

void TaskDispatcher::help() {
  claiming_ = true;
  next_.help = Time::clock::now() + second;  // a message that comes meanwhile shortens it
  struct Found {
    std::optional<queue::TaskClaim> claim;
    std::pair<std::string, std::string> document;
  };
  auto claim = [this, known = document_, excluded = joined(excluded_)] {
    Found found{store_->claim_other(excluded), known};
    if (!found.claim || found.claim->job_id == known.first) return found;
    try {
      found.document = {found.claim->job_id, queue_.queries.document(found.claim->job_id).value_or("")};
    } catch (...) {
      store_->release(*found.claim);  // the leases of this node are renewed together
      throw;
    }
    return found;
  };
  call_store("claim_task", std::move(claim), [this](std::optional<Found> found) {
    claiming_ = false;
    if (!found) next_.help = Time::clock::now() + second;
    if (!found || !found->claim) return;
    next_.help = {};  // there may be more
    document_ = std::move(found->document);
    if (process_.state() != WorkerState::ready) return release(*found->claim);
    start_helping(*std::move(found->claim));
  });
}

void TaskDispatcher::start_helping(queue::TaskClaim claim) {
  process_.send(pack(TraceTask{claim.job_id, claim.key, document_.second, std::exchange(claim.part, {})}));
  const Key key{claim.job_id, claim.key};
  helping_.insert_or_assign(key, std::move(claim));
}

/// A task may have caused it, so other nodes get them.
void TaskDispatcher::on_worker_exit() {
  for (const auto& [key, claim] : std::exchange(helping_, {})) {
    excluded_.insert(key.first);
    release(claim);
  }
  for (const auto& [key, claim] : std::exchange(own_, {})) release(claim);
  awaited_.clear();
}

}  // namespace worker
