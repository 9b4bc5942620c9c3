#include "server/worker/supervisor/result_backlog.h"

#include <fcntl.h>
#include <sys/sendfile.h>
#include <unistd.h>

#include <cerrno>
#include <exception>
#include <system_error>
#include <utility>

#include "server/support/locked.h"
namespace worker {
namespace {

std::uint64_t bytes_of(const Descriptor& memory) {
  const off_t size = ::lseek(memory.get(), 0, SEEK_END);
  return size < 0 ? 0 : static_cast<std::uint64_t>(size);
}

}  // namespace

ResultBacklog::ResultBacklog(const SupervisorSettings& settings, Store store, std::function<void()> on_change,
                             queue::Log log)
    : settings_(settings),
      store_(std::move(store)),
      on_change_(std::move(on_change)),
      log_(std::move(log)),
      thread_([this] { run(); }) {}

ResultBacklog::~ResultBacklog() {
  stop();
  thread_.join();
}

void ResultBacklog::stop() {
  const std::lock_guard lock(mutex_);
  stopping_ = true;
  waiting_.clear();
  bytes_ = 0;
  changed_.notify_all();
}

void ResultBacklog::add(Finished result) {
  auto waiting = std::make_shared<Waiting>(Waiting{std::move(result), 0});
  for (const Image& image : waiting->result.images) waiting->bytes += bytes_of(image.bytes);
  const bool has_room = support::locked(mutex_, [&] { return bytes_ + waiting->bytes <= settings_.waiting_bytes; });
  try {
    for (Image& image : waiting->result.images)
      if (has_room) move_to_disk(image);
  } catch (const std::system_error& failure) {  // it stays in memory
    log_(queue::LogLevel::warning, "result_not_on_disk", {{"detail", failure.what()}});
  }
  const std::lock_guard lock(mutex_);
  if (stopping_) return;
  if (waiting_.empty()) log_(queue::LogLevel::warning, "results_wait", {{"job_id", waiting->result.job_id}});
  bytes_ += waiting->bytes;
  waiting_.push_back(std::move(waiting));
  changed_.notify_all();
}

void ResultBacklog::move_to_disk(Image& image) const {
  Descriptor file(::open(settings_.waiting_directory.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600));
  const auto size = static_cast<off_t>(bytes_of(image.bytes));
  off_t done = 0;
  while (file && done < size) {
    const ssize_t count = ::sendfile(file.get(), image.bytes.get(), &done, static_cast<std::size_t>(size - done));
    if (count <= 0 && errno != EINTR) break;
  }
  if (!file || done < size) throw std::system_error(errno, std::generic_category(), settings_.waiting_directory);
  image.bytes = std::move(file);
}

std::size_t ResultBacklog::size() const {
  return support::locked(mutex_, [&] { return waiting_.size(); });
}

bool ResultBacklog::is_full() const {
  return support::locked(mutex_, [&] { return bytes_ >= settings_.waiting_bytes; });
}

void ResultBacklog::run() {
  std::unique_lock lock(mutex_);
  bool pause = true;  // the first one was tried by its caller
  while (!stopping_) {
    if (waiting_.empty()) {
      pause = true;
      changed_.wait(lock, [&] { return stopping_ || !waiting_.empty(); });
    } else if (pause && changed_.wait_for(lock, settings_.store_pause, [&] { return stopping_; })) {
      return;
    } else {
      pause = !store_first(lock);
    }
  }
}

/// False if it could not be stored.
bool ResultBacklog::store_first(std::unique_lock<std::mutex>& lock) {
  const std::shared_ptr<Waiting> first = waiting_.front();
  lock.unlock();
  std::string failure;
  try {
    store_(first->result);
  } catch (const std::exception& thrown) {
    failure = thrown.what();
  }
  lock.lock();
  if (!failure.empty()) {
    log_(queue::LogLevel::error, "store_failure", {{"during", "succeed"}, {"detail", failure}});
    return false;
  }
  if (stopping_) return true;
  waiting_.pop_front();
  bytes_ -= first->bytes;
  if (waiting_.empty()) log_(queue::LogLevel::info, "results_stored", {{"job_id", first->result.job_id}});
  lock.unlock();
  on_change_();
  lock.lock();
  return true;
}

}  // namespace worker
