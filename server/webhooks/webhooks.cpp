#include "server/webhooks/webhooks.h"

#include <openssl/evp.h>

#include <algorithm>
#include <optional>
#include <sstream>
#include <utility>

#include "server/resources/resource_json.h"
#include "server/support/locked.h"
#include "tracer/sha256.h"

namespace webhooks {
namespace {

constexpr std::string_view prefix = "whsec_";
constexpr std::size_t bytes_min = 24, bytes_max = 64;

const unsigned char* raw(std::string_view text) { return reinterpret_cast<const unsigned char*>(text.data()); }

std::string base64(std::string_view bytes) {
  std::string text(4 * ((bytes.size() + 2) / 3) + 1, '\0');
  const int size =
      EVP_EncodeBlock(reinterpret_cast<unsigned char*>(text.data()), raw(bytes), static_cast<int>(bytes.size()));
  text.resize(static_cast<std::size_t>(size));
  return text;
}

std::optional<Secret> read_secret(std::string_view text) {
  if (!text.starts_with(prefix)) return std::nullopt;
  text.remove_prefix(prefix.size());
  if (text.empty() || text.size() % 4 != 0 || text.size() > 4 * bytes_max) return std::nullopt;
  Secret secret(text.size() / 4 * 3, '\0');
  if (EVP_DecodeBlock(reinterpret_cast<unsigned char*>(secret.data()), raw(text), static_cast<int>(text.size())) < 0) {
    return std::nullopt;
  }
  secret.resize(secret.size() - static_cast<std::size_t>(std::count(text.end() - 2, text.end(), '=')));
  // Only the canonical encoding, so that equal secrets have equal texts.
  if (base64(secret) != text || secret.size() < bytes_min || secret.size() > bytes_max) return std::nullopt;
  return secret;
}

constexpr std::string_view test_event = "webhook.test";
constexpr int gone = 410;  // the receiver rejects further deliveries (Standard Webhooks, "Delivery")
constexpr std::chrono::milliseconds longest_sleep = std::chrono::hours(1);
/// Longer than any attempt takes (SenderSettings): then the node that has reserved a delivery is gone.
constexpr std::int64_t attempt_ms_max = 120'000;

bool is_success(int status) { return status >= 200 && status <= 299; }

}  // namespace

tracer::Result<std::vector<Secret>, std::string> read_secrets(const std::string& text) {
  std::vector<Secret> secrets;
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    auto secret = read_secret(word);
    if (!secret) return "secret " + std::to_string(secrets.size() + 1) + " is not whsec_ and 24 to 64 bytes in base64";
    secrets.push_back(*std::move(secret));
  }
  if (secrets.empty()) return std::string("there is no secret; one is whsec_ and 24 to 64 bytes in base64");
  return secrets;
}

std::string signature(const std::vector<Secret>& secrets, std::string_view id, std::int64_t timestamp_s,
                      std::string_view body) {
  std::string text(id);
  text.append(".").append(std::to_string(timestamp_s)).append(".").append(body);
  std::string value;
  for (const Secret& secret : secrets) {
    value += (value.empty() ? "v1," : " v1,") + base64(tracer::hmac_sha256(secret, text));
  }
  return value;
}

Webhooks::Webhooks(queue::DeliveryStore& store, FindJob find, Send send, queue::Clock clock, queue::IdSource& ids,
                   queue::Log log, WebhookSettings settings)
    : store_(store),
      find_(std::move(find)),
      send_(std::move(send)),
      clock_(std::move(clock)),
      ids_(ids),
      log_(std::move(log)),
      settings_(std::move(settings)) {
  // Jobs may have ended before this start; unknown ones were never accepted.
  for (const std::string& id : store_.subscribed_jobs()) {
    if (find_(id)) {
      subscribed_.insert(id);
    } else if (settings_.search_interval == Pause(0)) {  // otherwise another node may be about to store the job
      store_.unsubscribe(id);
    }
  }
  ended_ = subscribed_;
  thread_ = std::thread([this] { run(); });
}

Webhooks::~Webhooks() {
  support::locked(mutex_, [&] { stopping_ = true; });
  changed_.notify_all();
  thread_.join();
}

void Webhooks::register_webhook(const std::string& id, const api::Webhook& webhook) {
  store_.subscribe({id, webhook.url, webhook.events});
  const std::lock_guard lock(mutex_);
  subscribed_.insert(id);
}

void Webhooks::on_ended(const std::string& id) noexcept {
  {
    const std::lock_guard lock(mutex_);
    if (!subscribed_.contains(id)) return;
    ended_.insert(id);
  }
  changed_.notify_all();
}

bool Webhooks::redeliver(const std::string& job_id, const std::string& delivery_id) {
  if (!store_.redeliver(job_id, delivery_id, clock_())) return false;
  wake();
  return true;
}

std::string Webhooks::send_test(const std::string& url) {
  const std::int64_t now = clock_();
  std::string id = ids_.next();
  const std::string event(test_event), body = resources::write_event(test_event, now);
  store_.enqueue({ids_.next(), id, event, url, body, queue::DeliveryState::pending, now, now, {}});
  wake();
  return id;
}

void Webhooks::wake() {
  support::locked(mutex_, [&] { has_new_ = true; });
  changed_.notify_all();
}

void Webhooks::run() {
  for (;;) {
    Pause pause = settings_.store_pause;
    bool failed = false;
    try {
      pause = run_once();
    } catch (const std::exception& failure) {
      failed = true;
      log_(queue::LogLevel::warning, "webhook_store_error", {{"detail", failure.what()}});
    }
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, pause, [&] {
      return stopping_ || (!failed && (has_new_ || !ended_.empty() || !finished_hosts_.empty()));
    });
    if (stopping_) return;
    has_new_ = false;
  }
}

/// The jobs of a node that is gone have ended without a call of on_ended.
void Webhooks::search() {
  searched_at_ = std::chrono::steady_clock::now();
  for (const std::string& id : store_.subscribed_jobs()) {
    if (!find_(id)) continue;  // another node is about to store it
    const std::lock_guard lock(mutex_);
    ended_.insert(id);
  }
}

/// Does all that is due and returns the time until more is due.
Webhooks::Pause Webhooks::run_once() {
  const bool is_shared = settings_.search_interval > Pause(0);
  if (is_shared && std::chrono::steady_clock::now() - searched_at_ >= settings_.search_interval) search();
  for (;;) {
    std::string id;
    {
      const std::lock_guard lock(mutex_);
      if (stopping_ || ended_.empty()) break;
      id = ended_.extract(ended_.begin()).value();  // first, because it may end during create_delivery
    }
    try {
      create_delivery(id);
    } catch (...) {
      const std::lock_guard lock(mutex_);
      ended_.insert(id);
      throw;
    }
  }
  const Pause pause = dispatch_due();
  return is_shared ? std::min(pause, settings_.search_interval) : pause;
}

/// Replaces the subscription of an ended job by a delivery, or deletes it if its events do not include this end.
void Webhooks::create_delivery(const std::string& id) {
  const auto view = find_(id);
  if (view && !queue::ended(view->job.state)) return;
  const auto subscription = store_.subscription(id);
  const std::string state = view ? queue::name_of(view->job.state) : "";
  const bool subscribed = subscription && std::ranges::find(subscription->events, state) != subscription->events.end();
  if (subscribed) {
    const std::int64_t now = clock_();
    const std::string event = "job." + state;
    store_.replace_subscription({ids_.next(),
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
  subscribed_.erase(id);
}

/// Ends if nothing is due, if all senders are busy, or if a job has ended: new deliveries go before retries.
Webhooks::Pause Webhooks::dispatch_due() {
  for (;;) {
    {
      const std::lock_guard lock(mutex_);
      if (stopping_ || !ended_.empty()) return Pause(0);
      for (const std::string& host : std::exchange(finished_hosts_, {})) attempts_.erase(host);
    }
    if (attempts_.size() >= settings_.senders) return longest_sleep;
    std::set<std::string> busy_hosts;
    for (const auto& [host, attempt] : attempts_) busy_hosts.insert(host);
    auto delivery = store_.next(busy_hosts);
    if (!delivery) return longest_sleep;
    const Pause left(*delivery->next_attempt_at - clock_());
    if (left > Pause(0)) return std::min(left, longest_sleep);
    if (!store_.reserve(*delivery, clock_() + attempt_ms_max)) continue;
    const std::string host = queue::host_of(delivery->url);
    const auto send = [this, host, due = *std::move(delivery)] { run_attempt(host, due); };
    attempts_.emplace(host, std::async(std::launch::async, send));
  }
}

void Webhooks::run_attempt(const std::string& host, const queue::Delivery& delivery) {
  bool recorded = false;
  try {
    attempt(delivery);
    recorded = true;
  } catch (const std::exception& failure) {
    log_(queue::LogLevel::warning, "webhook_store_error", {{"detail", failure.what()}});
  }
  std::unique_lock lock(mutex_);
  // An attempt that was not recorded is repeated after a pause.
  if (!recorded) changed_.wait_for(lock, settings_.store_pause, [&] { return stopping_.load(); });
  finished_hosts_.push_back(host);
  changed_.notify_all();
}

void Webhooks::attempt(const queue::Delivery& delivery) {
  const std::int64_t start = clock_();
  const Response response = send_(delivery.url, headers_of(delivery, start), delivery.body, stopping_);
  if (stopping_ && response.status == 0) return;  // interrupted by the destructor
  const std::int64_t end = clock_();
  queue::DeliveryAttempt attempt{start, end - start, response.status, response.detail};
  const queue::LogFields fields{{"job_id", delivery.job_id}, {"delivery_id", delivery.id}};
  if (is_success(response.status)) {
    store_.record_attempt(delivery.id, attempt, queue::DeliveryState::delivered, std::nullopt);
    return log_(queue::LogLevel::info, "webhook_delivered", fields);
  }
  if (attempt.detail.empty()) attempt.detail = "the receiver answered " + std::to_string(response.status);
  const std::size_t failures = delivery.attempts.size();
  if (response.status == gone || failures >= retry_pauses.size() || delivery.event == test_event) {
    store_.record_attempt(delivery.id, attempt, queue::DeliveryState::abandoned, std::nullopt);
    return log_(queue::LogLevel::warning, "webhook_abandoned", fields);
  }
  store_.record_attempt(delivery.id, attempt, queue::DeliveryState::pending, end + retry_pauses[failures].count());
  log_(queue::LogLevel::info, "webhook_attempt_failed", fields);
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
