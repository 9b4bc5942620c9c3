#include "server/webhooks/webhooks.h"

#include <algorithm>
#include <utility>

#include "server/resources/job_json.h"

namespace webhooks {
namespace {

constexpr int gone = 410;  // the receiver wants nothing more (Standard Webhooks, "Delivery")
constexpr std::chrono::milliseconds longest_sleep = std::chrono::hours(1);

bool is_success(int status) { return status >= 200 && status <= 299; }

}  // namespace

Webhooks::Webhooks(queue::DeliveryStore& store, FindJob find, Send send, queue::Clock clock, queue::IdSource& ids,
                   queue::Log log, WebhookSettings settings)
    : store_(store),
      find_(std::move(find)),
      send_(std::move(send)),
      clock_(std::move(clock)),
      ids_(ids),
      log_(std::move(log)),
      settings_(std::move(settings)) {
  // What ended while nobody listened is among these; what is none of our jobs was never accepted.
  for (const std::string& id : store_.subscribed_jobs()) {
    if (find_(id)) {
      expected_.insert(id);
    } else {
      store_.unsubscribe(id);
    }
  }
  to_look_at_ = expected_;
  for (int i = 0; i < settings_.senders; ++i) senders_.emplace_back([this] { run_sender(); });
  thread_ = std::thread([this] { run(); });
}

Webhooks::~Webhooks() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  handed_out_.notify_all();
  thread_.join();
  for (std::thread& sender : senders_) sender.join();
}

void Webhooks::register_webhook(const std::string& id, const api::Webhook& webhook) {
  store_.subscribe({id, webhook.url, webhook.events});
  const std::lock_guard lock(mutex_);
  expected_.insert(id);
}

void Webhooks::on_ended(const std::string& id) noexcept {
  {
    const std::lock_guard lock(mutex_);
    if (!expected_.contains(id)) return;
    to_look_at_.insert(id);
  }
  changed_.notify_all();
}

void Webhooks::run() {
  for (;;) {
    Pause pause = settings_.store_pause;
    bool failed = false;
    try {
      pause = work();
    } catch (const std::exception& failure) {
      failed = true;
      log_(queue::LogLevel::warning, "webhook_store_error", {{"detail", failure.what()}});
    }
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, pause, [&] { return stopping_ || (!failed && (!to_look_at_.empty() || freed_)); });
    if (stopping_) return;
  }
}

/// Everything there is to do now; how long there is nothing more.
Webhooks::Pause Webhooks::work() {
  for (;;) {
    std::string id;
    {
      const std::lock_guard lock(mutex_);
      if (stopping_ || to_look_at_.empty()) break;
      id = to_look_at_.extract(to_look_at_.begin()).value();  // before it is looked at: it may end just then
    }
    try {
      update_variances(id);
    } catch (...) {
      const std::lock_guard lock(mutex_);
      to_look_at_.insert(id);
      throw;
    }
  }
  return dispatch_due();
}

/// Makes the message of a job that has ended, or strikes one that nobody wants to hear of.
void Webhooks::update_variances(const std::string& id) {
  const auto view = find_(id);
  if (view && !queue::ended(view->job.state)) return;
  const auto subscription = store_.subscription(id);
  const std::string state = view ? queue::name_of(view->job.state) : "";
  const bool wanted = subscription && std::find(subscription->events.begin(), subscription->events.end(), state) !=
                                          subscription->events.end();
  if (wanted) {
    const std::int64_t now = clock_();
    const std::string event = "job." + state;
    store_.enqueue({ids_.next(),
                    id,
                    event,
                    subscription->url,
                    resources::write_event(event, *view, now),
                    queue::DeliveryState::pending,
                    now,
                    now,
                    {}});
    store_.delete_before(now - settings_.log_age.count());
  } else {
    store_.unsubscribe(id);
  }
  const std::lock_guard lock(mutex_);
  expected_.erase(id);
}

/// Ends when there is nothing more, when nobody is free to send it, or when a job has ended: new messages stand before
/// old ones' next attempts.
Webhooks::Pause Webhooks::dispatch_due() {
  for (;;) {
    std::set<std::string> busy;
    {
      const std::lock_guard lock(mutex_);
      if (stopping_ || !to_look_at_.empty()) return Pause(0);
      freed_ = false;
      if (busy_.size() >= senders_.size()) return longest_sleep;
      busy = busy_;
    }
    auto delivery = store_.next(busy);
    if (!delivery) return longest_sleep;
    const Pause left(*delivery->next_attempt_at - clock_());
    if (left > Pause(0)) return std::min(left, longest_sleep);
    const std::lock_guard lock(mutex_);
    busy_.insert(queue::host_of(delivery->url));
    to_send_.push_back(*std::move(delivery));
    handed_out_.notify_one();
  }
}

/// A sender's thread.
void Webhooks::run_sender() {
  std::unique_lock lock(mutex_);
  for (;;) {
    handed_out_.wait(lock, [&] { return stopping_ || !to_send_.empty(); });
    if (stopping_) return;
    const queue::Delivery delivery = std::move(to_send_.front());
    to_send_.pop_front();
    lock.unlock();
    bool noted = false;
    try {
      attempt(delivery);
      noted = true;
    } catch (const std::exception& failure) {
      log_(queue::LogLevel::warning, "webhook_store_error", {{"detail", failure.what()}});
    }
    lock.lock();
    // What could not be noted is due as before: the receiver gets it again, but not at once.
    if (!noted) handed_out_.wait_for(lock, settings_.store_pause, [&] { return stopping_.load(); });
    busy_.erase(queue::host_of(delivery.url));
    freed_ = true;
    changed_.notify_all();
  }
}

void Webhooks::attempt(const queue::Delivery& delivery) {
  const std::int64_t start = clock_();
  const Answer answer = send_(delivery.url, headers_of(delivery, start), delivery.body, stopping_);
  if (stopping_ && answer.status == 0) return;  // it was we who ended it
  const std::int64_t end = clock_();
  queue::DeliveryAttempt attempt{start, end - start, answer.status, answer.detail};
  const queue::LogFields fields{{"job_id", delivery.job_id}, {"delivery_id", delivery.id}};
  if (is_success(answer.status)) {
    store_.record_attempt(delivery.id, attempt, queue::DeliveryState::delivered, std::nullopt);
    return log_(queue::LogLevel::info, "webhook_delivered", fields);
  }
  if (attempt.detail.empty()) attempt.detail = "the receiver answered " + std::to_string(answer.status);
  const std::size_t failures = delivery.attempts.size();
  if (answer.status == gone || failures >= retry_pauses.size()) {
    store_.record_attempt(delivery.id, attempt, queue::DeliveryState::given_up, std::nullopt);
    return log_(queue::LogLevel::warning, "webhook_abandoned", fields);
  }
  store_.record_attempt(delivery.id, attempt, queue::DeliveryState::pending, end + retry_pauses[failures].count());
  log_(queue::LogLevel::info, "webhook_failed", fields);
}

WebhookSender::Headers Webhooks::headers_of(const queue::Delivery& delivery, std::int64_t now) const {
  const std::int64_t timestamp_s = now / 1000;
  return {{"Content-Type", "application/json"},
          {"User-Agent", "whittle"},
          {"webhook-id", delivery.id},
          {"webhook-timestamp", std::to_string(timestamp_s)},
          {"webhook-signature", signature(settings_.secrets, delivery.id, timestamp_s, delivery.body)}};
}

}  // namespace webhooks
