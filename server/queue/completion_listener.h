#pragma once
/// The interface of the queue to the webhooks of jobs.

#include <string>

#include "api/document.h"

namespace queue {

/// Called from any thread.
class CompletionListener {
 public:
  virtual ~CompletionListener() = default;

  /// Called before the job `id` with this webhook is stored. Durable when it returns; throws StoreFailure, and then the
  /// job is not stored.
  virtual void register_webhook(const std::string& id, const api::Webhook& webhook) = 0;

  /// The job has ended or was removed. Returns at once. Ends before a restart are not repeated.
  virtual void on_ended(const std::string& id) noexcept = 0;
};

}  // namespace queue
