#pragma once
/// Who wants to be told when jobs end, as the queue sees it: durable wishes, made with the job.

#include <string>

#include "api/document.h"

namespace queue {

/// Called from any thread.
class CompletionListener {
 public:
  virtual ~CompletionListener() = default;

  /// The job `id` is about to be stored, and its owner asks to be told of its end. Durable when it returns; throws
  /// StoreFailure, and then the job is not stored.
  virtual void expect(const std::string& id, const api::Webhook& webhook) = 0;

  /// The job has ended, or is gone. Returns at once. After a restart it is the listener that asks which have.
  virtual void ended(const std::string& id) noexcept = 0;
};

}  // namespace queue
