#include "server/worker/process/task_exchange.h"

#include <algorithm>
#include <utility>

#include "tracer/sha256.h"
#include "tracer/version.h"

namespace worker {
namespace {

constexpr std::chrono::milliseconds poll_interval{50};
constexpr std::chrono::seconds patience{20};  // four leases of a task
/// Rounds with fewer samples take some tens of milliseconds.
constexpr std::uint64_t samples_min = 1u << 16;
/// Least time that other workers must save, beside the time to compile and to transfer.
constexpr double saving_ms_min = 200;
/// Between two nodes and the database, both ways: measured at 90 to 170 MB/s on one machine.
constexpr double bytes_per_ms = 40'000;
/// Parts and results of one job in the database.
constexpr double job_bytes_max = 1e9;
constexpr std::size_t message_bytes = 4u << 20;

}  // namespace

TaskExchange::TaskExchange(TaskExchangeSettings settings, const std::atomic<std::int64_t>& helpers,
                           const tracer::RenderControl& control, std::function<void(Message)> send)
    : settings_(std::move(settings)), helpers_(helpers), control_(control), send_(std::move(send)) {}

bool TaskExchange::divides(std::uint64_t samples) {
  const std::lock_guard lock(mutex_);
  return samples >= samples_min && published_.bytes < job_bytes_max;
}

void TaskExchange::begin(std::span<const tracer::Part> parts) {
  const std::lock_guard lock(mutex_);
  parts_ = parts;
  next_ = 0;
  keys_.assign(parts.size(), {});
  part_of_key_.clear();
  taken_.clear();
  results_.clear();
  started_.clear();
  none_left_ = false;
  done_.assign(parts.size(), false);
  progress_at_ = Clock::now();
}

std::optional<std::size_t> TaskExchange::take() {
  std::unique_lock lock(mutex_);
  if (part_of_key_.empty() && (settings_.resumes || should_publish())) publish();
  if (part_of_key_.empty()) {
    if (next_ == parts_.size()) return std::nullopt;
    started_[next_] = Clock::now();
    return next_++;
  }
  ++waiting_;
  while (taken_.empty() && !none_left_ && !control_.cancelled()) {
    if (requested_ < waiting_) request_task();
    changed_.wait_for(lock, poll_interval);
  }
  --waiting_;
  if (control_.cancelled()) return std::nullopt;
  if (taken_.empty()) return overdue_part();
  const std::size_t part = taken_.front();
  taken_.pop_front();
  if (!none_left_ && requested_ <= waiting_) request_task();  // the next one arrives while this one is traced
  started_[part] = progress_at_ = Clock::now();
  return part;
}

/// The database may have lost the tasks.
std::optional<std::size_t> TaskExchange::overdue_part() {
  if (Clock::now() < progress_at_ + patience) return std::nullopt;
  for (std::size_t part = 0; part < done_.size(); ++part) {
    if (done_[part] || started_.contains(part)) continue;
    started_[part] = Clock::now();
    return part;
  }
  return std::nullopt;
}

void TaskExchange::put(std::size_t part, std::string_view result) {
  std::string key;
  {
    const std::lock_guard lock(mutex_);
    if (const auto started = started_.extract(part)) {
      traced_.ms += std::chrono::duration<double, std::milli>(Clock::now() - started.mapped()).count();
      traced_.samples += static_cast<double>(parts_[part].samples);
      traced_.bytes += static_cast<double>(result.size());
    }
    done_[part] = true;
    key = keys_[part];
    if (key.empty()) return;
    ++published_.division.tasks;
    published_.bytes += static_cast<double>(result.size());
  }
  send_(TaskTraced{settings_.job_id, key, false, std::string(result)});
}

std::vector<tracer::PartResult> TaskExchange::wait() {
  std::unique_lock lock(mutex_);
  if (results_.empty() && !control_.cancelled()) changed_.wait_for(lock, poll_interval);
  none_left_ = false;  // a task of a worker that has ended may be left
  return std::exchange(results_, {});
}

double TaskExchange::remaining_ms() const {
  double samples = 0;
  for (std::size_t part = next_; part < parts_.size(); ++part) samples += static_cast<double>(parts_[part].samples);
  return samples * traced_.ms / traced_.samples / settings_.threads;
}

/// With one more worker the rest takes half as long, and the time to compile and to transfer.
bool TaskExchange::should_publish() const {
  if (helpers_ <= 0 || !(traced_.samples > 0) || next_ + 2 > parts_.size()) return false;
  double bytes = 0;
  for (std::size_t part = next_; part < parts_.size(); ++part)
    bytes += static_cast<double>(parts_[part].bytes.size()) +
             static_cast<double>(parts_[part].samples) * traced_.bytes / traced_.samples;
  const double build_ms = published_.any ? 0 : settings_.build_ms;
  return remaining_ms() / 2 > saving_ms_min + build_ms + bytes / bytes_per_ms;
}

void TaskExchange::publish() {
  published_.any = true;
  PublishTasks message{settings_.job_id, {}};
  std::size_t size = 0;
  for (; next_ < parts_.size(); ++next_) {
    const std::string& part = parts_[next_].bytes;
    keys_[next_] = tracer::sha256_hex(settings_.document_hash + std::string(tracer::build()) + part);
    part_of_key_[keys_[next_]] = next_;
    message.tasks.push_back({keys_[next_], part});
    published_.bytes += static_cast<double>(part.size());
    size += part.size();
    if (size < message_bytes && next_ + 1 < parts_.size()) continue;
    send_(std::exchange(message, PublishTasks{settings_.job_id, {}}));
    size = 0;
  }
}

void TaskExchange::request_task() {
  ++requested_;
  send_(TakeTask{settings_.job_id});
}

void TaskExchange::on_taken(const TaskTaken& message) {
  const std::lock_guard lock(mutex_);
  --requested_;
  const auto found = part_of_key_.find(message.key);
  if (found != part_of_key_.end()) {
    taken_.push_back(found->second);
    published_.division.repeated_tasks += static_cast<std::uint64_t>(std::max<std::int64_t>(message.attempt, 1) - 1);
  } else if (message.key.empty()) {
    none_left_ = true;
  }
  changed_.notify_all();
}

void TaskExchange::on_done(TaskDone&& message) {
  const std::lock_guard lock(mutex_);
  const auto found = part_of_key_.find(message.key);
  if (found == part_of_key_.end()) return;
  ++published_.division.tasks;
  published_.division.repeated_tasks += static_cast<std::uint64_t>(std::max<std::int64_t>(message.attempt, 1) - 1);
  published_.bytes += static_cast<double>(message.result.size());
  published_.nodes.insert(message.node);
  done_[found->second] = true;
  progress_at_ = Clock::now();
  results_.push_back({found->second, std::move(message.result)});
  changed_.notify_all();
}

api::Division TaskExchange::division() const {
  const std::lock_guard lock(mutex_);
  if (published_.division.tasks == 0) return {};
  api::Division division = published_.division;
  division.workers += published_.nodes.size();
  return division;
}

}  // namespace worker
