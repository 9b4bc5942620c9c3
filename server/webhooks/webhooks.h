#pragma once
/// Sends a signed webhook when a job has ended, and retries until it is delivered, also after restarts.
///
///   const storage::sqlite::SqliteStores stores(directory);  // server/storage/sqlite/sqlite_stores.h
///   webhooks::Webhooks webhooks(stores.deliveries(), find, send, clock, ids, log, settings);
///   queue.set_completion_listener(&webhooks);                     // before anything is submitted or run
///
/// A subscription is stored before its job, and replaced by a delivery in one commit when the job has ended, so kill -9
/// loses none. The receiver may get a delivery twice, with the same webhook-id. A job that is removed within
/// milliseconds after its end has no delivery.

#include <array>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <future>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "server/queue/clock.h"
#include "server/queue/delivery_store.h"
#include "server/queue/event_log.h"
#include "server/queue/job_observer.h"
#include "server/queue/queue.h"
#include "server/webhooks/webhook_sender.h"
#include "tracer/result.h"

namespace webhooks {

using Secret = std::string;  ///< bytes

/// Parses secrets separated by white space, each "whsec_" and 24 to 64 bytes in base64. An error is a sentence without
/// any secret.
tracer::Result<std::vector<Secret>, std::string> read_secrets(const std::string& text);

/// The value of webhook-signature according to Standard Webhooks 1.0.0 (standardwebhooks.com, "Signature scheme"):
/// "v1," and the HMAC-SHA256 (RFC 2104) of "id.timestamp.body" in base64 (RFC 4648), once for each secret, so that
/// secrets can be rotated, separated by spaces.
std::string signature(const std::vector<Secret>& secrets, std::string_view id, std::int64_t timestamp_s,
                      std::string_view body);

/// Pauses between attempts; after the last one the delivery is abandoned. They sum up to 18 hours, the outage of a
/// night.
inline constexpr std::array<std::chrono::milliseconds, 7> retry_pauses{
    std::chrono::seconds(5), std::chrono::minutes(1), std::chrono::minutes(10), std::chrono::minutes(30),
    std::chrono::hours(2),   std::chrono::hours(5),   std::chrono::hours(10)};

struct WebhookSettings {
  std::vector<Secret> secrets;                               ///< at least one
  std::chrono::milliseconds log_age{std::chrono::days(30)};  ///< completed deliveries are deleted after it
  std::chrono::milliseconds store_pause{1'000};              ///< after a failure of the store
  /// Concurrent requests, each to another receiver. A hanging receiver blocks one of them for some seconds
  /// (SenderSettings).
  std::size_t senders = 16;
  /// Pause between searches for what a node that is gone has left, if nodes share the store. 0: one node.
  std::chrono::milliseconds search_interval{0};
};

using FindJob = std::function<std::optional<queue::JobView>(const std::string& id)>;
using Send = std::function<Response(const std::string& url, const WebhookSender::Headers& headers,
                                    const std::string& body, const std::atomic<bool>& stop)>;

/// One thread creates deliveries of ended jobs and dispatches due ones; each attempt has a thread of its own. A
/// receiver gets one delivery at a time, in the order in which they are due.
class Webhooks final : public queue::CompletionListener {
 public:
  /// The store, and `ids`, must outlive it. Throws StoreFailure.
  Webhooks(queue::DeliveryStore& store, FindJob find, Send send, queue::Clock clock, queue::IdSource& ids,
           queue::Log log, WebhookSettings settings);
  ~Webhooks() override;  ///< interrupts requests; they do not count as attempts
  Webhooks(Webhooks&&) = delete;

  /// Sends a delivery of the job again, with the same id and content; its pauses continue after its last attempt. False
  /// if there is none. Throws StoreFailure, as the next.
  bool redeliver(const std::string& job_id, const std::string& delivery_id);
  /// Sends one message of type "webhook.test", without retries. Returns the id under which the store has the delivery.
  std::string send_test(const std::string& url);

  void register_webhook(const std::string& id, const api::Webhook& webhook) override;
  void on_ended(const std::string& id) noexcept override;

 private:
  using Pause = std::chrono::milliseconds;

  void run();
  void wake();
  Pause run_once();
  void create_delivery(const std::string& id);
  Pause dispatch_due();
  void search();
  void run_attempt(const std::string& host, const queue::Delivery& delivery);
  void attempt(const queue::Delivery& delivery);
  [[nodiscard]] WebhookSender::Headers headers_of(const queue::Delivery& delivery, std::int64_t now) const;

  queue::DeliveryStore& store_;
  FindJob find_;
  Send send_;
  queue::Clock clock_;
  queue::IdSource& ids_;
  queue::Log log_;
  WebhookSettings settings_;

  std::chrono::steady_clock::time_point searched_at_ = std::chrono::steady_clock::now();
  std::atomic<bool> stopping_ = false;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::set<std::string> subscribed_;                   ///< jobs with a subscription
  std::set<std::string> ended_;                        ///< subscribed jobs that may have ended
  bool has_new_ = false;                               ///< deliveries were added or made due
  std::vector<std::string> finished_hosts_;            ///< their attempts have ended
  std::map<std::string, std::future<void>> attempts_;  ///< by host; used by thread_ only
  std::thread thread_;                                 ///< last: it uses all other members
};

}  // namespace webhooks
