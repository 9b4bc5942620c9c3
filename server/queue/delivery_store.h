#pragma once
/// Where it stands who is to be told of a job's end, what was sent and what came back. Every call that answers without
/// an exception is durable when it returns. Thread-safe. Fails with StoreFailure; then nothing has happened. Times are
/// milliseconds since 1970 UTC.

#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace queue {

/// A job's owner's wish to be told.
struct Subscription {
  std::string job_id;
  std::string url;
  std::vector<std::string> events;  ///< names of ended states
};

struct DeliveryAttempt {
  std::int64_t at = 0;
  std::int64_t duration_ms = 0;
  int status = 0;      ///< of HTTP; 0: no answer came
  std::string detail;  ///< why it failed, in words; empty when it was delivered
};

enum class DeliveryState { pending, delivered, abandoned };
const char* name_of(DeliveryState state);

/// A message that is owed: the same bytes at every attempt.
struct Delivery {
  std::string id;  ///< webhook-id: the receiver tells repetitions by it
  std::string job_id;
  std::string event;  ///< "job.succeeded"
  std::string url;
  std::string body;
  DeliveryState state = DeliveryState::pending;
  std::int64_t created_at = 0;
  std::optional<std::int64_t> next_attempt_at;  ///< while pending
  std::vector<DeliveryAttempt> attempts;
};

/// Who gets what is sent to `url`, an http or https one without user: host and port, in lower case.
std::string host_of(const std::string& url);

class DeliveryStore {
 public:
  virtual ~DeliveryStore() = default;

  virtual void subscribe(const Subscription& subscription) = 0;  ///< in place of an earlier one of the job
  virtual std::optional<Subscription> subscription(const std::string& job_id) = 0;
  virtual std::vector<std::string> subscribed_jobs() = 0;
  virtual void unsubscribe(const std::string& job_id) = 0;

  /// Takes the place of its job's subscription. Precondition: pending, without attempts, with a new id.
  virtual void enqueue(const Delivery& delivery) = 0;

  /// The pending one whose next attempt is earliest, of those to receivers that are none of `busy`. However many are
  /// owed to these it takes no longer.
  virtual std::optional<Delivery> next(const std::set<std::string>& busy) = 0;
  /// Notes what became of an attempt. Without `next_attempt_at` the delivery is not pending any more.
  virtual void record_attempt(const std::string& id, const DeliveryAttempt& attempt, DeliveryState state,
                              std::optional<std::int64_t> next_attempt_at) = 0;

  virtual std::vector<Delivery> of_job(const std::string& job_id) = 0;  ///< oldest first
  /// Deletes those that are not pending and were created before `then`.
  virtual void delete_before(std::int64_t then) = 0;
};

}  // namespace queue
