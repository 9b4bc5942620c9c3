#pragma once
/// Durable storage of webhook subscriptions, deliveries and attempts. A call that returns is durable. Thread-safe.
/// Fails with StoreFailure; then the call had no effect. Times are milliseconds since 1970 UTC.

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "server/storage/sql/sql_database.h"
#include "server/support/text_values.h"

namespace queue {

/// The webhook of a job that has not ended.
struct Subscription {
  std::string job_id;
  std::string url;
  std::vector<std::string> events;  ///< names of ended states
};

struct DeliveryAttempt {
  std::int64_t at = 0;
  std::int64_t duration_ms = 0;
  int status = 0;      ///< HTTP status; 0: no response
  std::string detail;  ///< the reason of a failure; empty when it was delivered
};

enum class DeliveryState { pending, delivered, abandoned };
inline const char* name_of(DeliveryState state) {
  constexpr std::array names{"pending", "delivered", "abandoned"};
  return names[static_cast<std::size_t>(state)];
}
inline void from_text(const std::string& text, DeliveryState& state) {
  using enum DeliveryState;
  state = text == name_of(pending) ? pending : text == name_of(delivered) ? delivered : abandoned;
}

/// A message to a webhook: the same bytes at every attempt.
struct Delivery {
  std::string id;      ///< webhook-id: receivers recognise repetitions by it
  std::string job_id;  ///< or the id of a test call
  std::string event;   ///< "job.succeeded"
  std::string url;
  std::string body;
  DeliveryState state = DeliveryState::pending;
  std::int64_t created_at = 0;
  std::optional<std::int64_t> next_attempt_at;  ///< while pending
  std::vector<DeliveryAttempt> attempts;
};

/// Host and port of an http or https URL without user, in lower case.
inline std::string host_of(const std::string& url) {
  const std::size_t scheme_end = url.find("://");
  const std::size_t begin = scheme_end == std::string::npos ? 0 : scheme_end + 3;
  return support::lowered(url.substr(begin, url.find_first_of("/?#", begin) - begin));
}

class DeliveryStore {
 public:
  /// The tables must exist: see the schemas of server/storage/sqlite and server/storage/postgres. `transactions` must
  /// outlive it.
  explicit DeliveryStore(storage::sql::Transactions& transactions) : transactions_(transactions) {}

  void subscribe(const Subscription& subscription);  ///< replaces an earlier one of the job
  std::optional<Subscription> subscription(const std::string& job_id);
  std::vector<std::string> subscribed_jobs();
  void unsubscribe(const std::string& job_id);

  /// Precondition: pending, without attempts, with a new id.
  void enqueue(const Delivery& delivery);
  /// Enqueues a delivery and removes the subscription of its job. Returns false, without an effect, if there is no
  /// subscription: another node has made the delivery.
  bool replace_subscription(const Delivery& delivery);

  /// The pending delivery with the earliest next attempt whose host is not in `busy`. Its cost does not grow with the
  /// number of deliveries.
  std::optional<Delivery> next(const std::set<std::string>& busy);
  /// Before an attempt of what `next` has returned: no other node begins one before `until`. False if one has begun
  /// one. No effect where the store has one node.
  bool reserve(const Delivery& delivery, std::int64_t until);
  /// Records the result of an attempt. Without `next_attempt_at` the delivery is not pending any more.
  void record_attempt(const std::string& id, const DeliveryAttempt& attempt, DeliveryState state,
                      std::optional<std::int64_t> next_attempt_at);

  std::vector<Delivery> of_job(const std::string& job_id);  ///< oldest first
  /// Makes a delivery of the job pending again, due at `now`. False if there is none.
  bool redeliver(const std::string& job_id, const std::string& id, std::int64_t now);
  /// Deletes deliveries that are not pending and were created before `then`.
  void delete_before(std::int64_t then);

 private:
  storage::sql::Transactions& transactions_;
};

}  // namespace queue
