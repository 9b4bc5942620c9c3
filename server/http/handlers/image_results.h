#pragma once
/// Results of the worker's tasks on finished images.

#include <chrono>
#include <cstddef>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <string>
#include <unordered_map>

#include "server/http/handlers/lru_cache.h"
#include "server/http/http_messages.h"
#include "server/queue/job_runner.h"

namespace http::handlers {

using ImageResult = std::shared_ptr<const queue::ImageTaskResult>;

/// Runs each task once for all requests that wait for it, and keeps its result. A client whose request ends before
/// repeats it; then it waits for the same task or gets the result. Thread-safe.
class ImageTasks : public std::enable_shared_from_this<ImageTasks> {
 public:
  /// Requests wait at most `wait`. Kept results have `bytes_max` together. 64 MiB are those of 2000 frames.
  ImageTasks(queue::AttachedRunner& runner, std::chrono::milliseconds wait, std::size_t bytes_max = 64u << 20)
      : runner_(runner), wait_(wait), results_(bytes_max) {}

  /// The result of an earlier task that succeeded; null if it is not kept.
  ImageResult find(const std::string& key);
  /// The reply that `resume` makes of the result of a task that succeeds. `key` determines the images and the work.
  /// Problems: 404, 409, 422, 503.
  Answer run(const std::string& key, const queue::ImageTask& task, std::function<Answer(const ImageResult&)> resume);

 private:
  struct Running {
    ImageResult result;
    std::list<std::function<void()>> waiting;
  };
  void end(const std::string& key, const ImageResult& result);

  queue::AttachedRunner& runner_;
  std::chrono::milliseconds wait_;
  LruCache<ImageResult> results_;
  std::mutex mutex_;  ///< guards the tasks that run
  std::unordered_map<std::string, std::shared_ptr<Running>> running_;
};

}  // namespace http::handlers
