#pragma once
/// Tells whoever asked that a job has ended: signed, again and again until the receiver has it, over restarts.
///
///   storage::sqlite::SqliteDeliveryStore deliveries(directory);   // server/storage/sqlite/sqlite_delivery_store.h
///   webhooks::Webhooks webhooks(deliveries, find, send, clock, ids, log, settings);
///   queue.set_completion_listener(&webhooks);                     // before anything is submitted or run
///
/// A wish is stored before its job, and becomes a message in one commit when the job has ended; so a message that is
/// owed survives kill -9. The receiver may get it twice, with the same webhook-id. A job that is removed before its end
/// was looked at, some milliseconds, is not told of.

#include <array>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "server/queue/clock.h"
#include "server/queue/completion_listener.h"
#include "server/queue/delivery_store.h"
#include "server/queue/event_log.h"
#include "server/queue/job_id.h"
#include "server/queue/queue.h"
#include "server/webhooks/poster.h"
#include "server/webhooks/signature.h"

namespace webhooks {

/// Pauses between attempts; after the last the message is given up. The first catches a receiver that is being started
/// anew, the others a night's outage, 18 hours in all.
inline constexpr std::array<std::chrono::milliseconds, 7> retry_pauses{
    std::chrono::seconds(5), std::chrono::minutes(1), std::chrono::minutes(10), std::chrono::minutes(30),
    std::chrono::hours(2),   std::chrono::hours(5),   std::chrono::hours(10)};

struct WebhookSettings {
  std::vector<Secret> secrets;                               ///< at least one
  std::chrono::milliseconds log_age{std::chrono::days(30)};  ///< deliveries that are over are forgotten then
  std::chrono::milliseconds store_pause{1'000};              ///< before a store that failed is asked again
  /// Receivers that are sent to at once. One that hangs keeps a thread waiting for some seconds (PosterSettings) and
  /// nobody else; so many that hang at once are somebody's malice.
  int senders = 16;
};

using FindJob = std::function<std::optional<queue::JobView>(const std::string& id)>;
using Send = std::function<Answer(const std::string& url, const WebhookSender::Headers& headers,
                                  const std::string& body, const std::atomic<bool>& stop)>;

/// One thread looks at what has ended and hands out what is due; others send it. A receiver gets one message at a time,
/// in the order in which they are due.
class Webhooks final : public queue::CompletionListener {
 public:
  /// The store, and `ids`, must outlive it. Throws StoreFailure.
  Webhooks(queue::DeliveryStore& store, FindJob find, Send send, queue::Clock clock, queue::IdSource& ids,
           queue::Log log, WebhookSettings settings);
  ~Webhooks() override;  ///< cuts requests in progress short; they are attempts that are not counted
  Webhooks(const Webhooks&) = delete;
  Webhooks& operator=(const Webhooks&) = delete;

  void register_webhook(const std::string& id, const api::Webhook& webhook) override;
  void on_ended(const std::string& id) noexcept override;

 private:
  using Pause = std::chrono::milliseconds;

  void run();
  Pause work();
  void update_variances(const std::string& id);
  Pause dispatch_due();
  void run_sender();
  void attempt(const queue::Delivery& delivery);
  [[nodiscard]] WebhookSender::Headers headers_of(const queue::Delivery& delivery, std::int64_t now) const;

  queue::DeliveryStore& store_;
  FindJob find_;
  Send send_;
  queue::Clock clock_;
  queue::IdSource& ids_;
  queue::Log log_;
  WebhookSettings settings_;

  std::atomic<bool> stopping_ = false;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::set<std::string> expected_;    ///< jobs somebody wants to hear of
  std::set<std::string> to_look_at_;  ///< those that may have ended
  std::condition_variable handed_out_;
  std::deque<queue::Delivery> to_send_;
  std::set<std::string> busy_;  ///< receivers that something is handed out for or on its way to
  bool freed_ = false;          ///< one of them is not any more
  std::vector<std::thread> senders_;
  std::thread thread_;  ///< last: starts when the rest is there
};

}  // namespace webhooks
