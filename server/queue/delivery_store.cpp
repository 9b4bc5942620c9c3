#include "server/queue/delivery_store.h"

#include "server/queue/job_rows.h"

namespace queue {
namespace {

constexpr const char* delivery_columns =
    "SELECT id, job_id, event, url, body, state, created_at, next_attempt_at FROM deliveries";

Delivery read_delivery(sql::Query& row) {
  Delivery delivery;
  row.take(delivery.id, delivery.job_id, delivery.event, delivery.url, delivery.body, delivery.state,
           delivery.created_at, delivery.next_attempt_at);
  return delivery;
}

DeliveryAttempt read_attempt(sql::Query& row) {
  DeliveryAttempt attempt;
  row.take(attempt.at, attempt.duration_ms, attempt.status, attempt.detail);
  return attempt;
}

std::vector<Delivery> read_deliveries(sql::Database& database, const std::string& condition, const std::string& value) {
  std::vector<Delivery> deliveries = database.query(delivery_columns + condition, value).all(read_delivery);
  for (Delivery& delivery : deliveries) {
    sql::Query attempts = database.query(
        "SELECT at, duration_ms, status, detail FROM attempts WHERE delivery_id = ? ORDER BY number", delivery.id);
    delivery.attempts = attempts.all(read_attempt);
  }
  return deliveries;
}

int insert_delivery(sql::Database& database, const Delivery& delivery) {
  return database.change(
      "INSERT INTO deliveries (id, job_id, event, url, body, state, created_at, next_attempt_at, host)"
      " VALUES (?, ?, ?, ?, ?, 'pending', ?, ?, ?)",
      delivery.id, delivery.job_id, delivery.event, delivery.url, delivery.body, delivery.created_at,
      delivery.next_attempt_at.value_or(delivery.created_at), host_of(delivery.url));
}

}  // namespace

void DeliveryStore::subscribe(const Subscription& subscription) {
  transactions_.change(
      "INSERT INTO subscriptions (job_id, url, events) VALUES (?1, ?2, ?3)"
      " ON CONFLICT (job_id) DO UPDATE SET url = ?2, events = ?3",
      subscription.job_id, subscription.url, joined(subscription.events));
}

std::optional<Subscription> DeliveryStore::subscription(const std::string& job_id) {
  return transactions_.read([&](sql::Database& database) -> std::optional<Subscription> {
    sql::Query row = database.query("SELECT url, events FROM subscriptions WHERE job_id = ?", job_id);
    if (!row.row()) return std::nullopt;
    return Subscription{job_id, row.text(0), split(row.text(1))};
  });
}

std::vector<std::string> DeliveryStore::subscribed_jobs() {
  return transactions_.texts("SELECT job_id FROM subscriptions ORDER BY job_id");
}

void DeliveryStore::unsubscribe(const std::string& job_id) {
  transactions_.change("DELETE FROM subscriptions WHERE job_id = ?", job_id);
}

void DeliveryStore::enqueue(const Delivery& delivery) {
  transactions_.write([&](sql::Database& database) { return insert_delivery(database, delivery); });
}

bool DeliveryStore::replace_subscription(const Delivery& delivery) {
  return transactions_.write([&](sql::Database& database) {
    if (database.change("DELETE FROM subscriptions WHERE job_id = ?", delivery.job_id) == 0) return false;
    insert_delivery(database, delivery);
    return true;
  });
}

std::optional<Delivery> DeliveryStore::next(const std::set<std::string>& busy) {
  return transactions_.read([&](sql::Database& database) -> std::optional<Delivery> {
    std::pair<std::int64_t, std::string> earliest;
    {
      // The first of each host, by steps from one host to the next in the index.
      sql::Query first = database.query(
          "WITH RECURSIVE hosts (name) AS (SELECT min(host) FROM deliveries WHERE state = 'pending'"
          " UNION ALL SELECT (SELECT min(host) FROM deliveries WHERE state = 'pending' AND host > name)"
          " FROM hosts WHERE name IS NOT NULL)"
          " SELECT name, next_attempt_at, id FROM hosts JOIN deliveries ON id = (SELECT id FROM deliveries"
          " WHERE state = 'pending' AND host = name ORDER BY next_attempt_at, id LIMIT 1) WHERE name IS NOT NULL");
      while (first.row()) {
        if (busy.contains(first.text(0))) continue;
        const std::pair candidate{first.integer(1), first.text(2)};
        if (earliest.second.empty() || candidate < earliest) earliest = candidate;
      }
    }
    if (earliest.second.empty()) return std::nullopt;
    std::vector<Delivery> found = read_deliveries(database, " WHERE id = ?", earliest.second);
    return std::move(found.front());
  });
}

bool DeliveryStore::reserve(const Delivery& delivery, std::int64_t until) {
  if (!transactions_.read([](sql::Database& database) { return database.is_shared(); })) return true;
  return transactions_.change("UPDATE deliveries SET next_attempt_at = ? WHERE id = ? AND next_attempt_at = ?", until,
                              delivery.id, delivery.next_attempt_at) == 1;
}

void DeliveryStore::record_attempt(const std::string& id, const DeliveryAttempt& attempt, DeliveryState state,
                                   std::optional<std::int64_t> next_attempt_at) {
  transactions_.write([&](sql::Database& database) {
    database.change(
        "INSERT INTO attempts (delivery_id, number, at, duration_ms, status, detail)"
        " VALUES (?1, (SELECT count(*) FROM attempts WHERE delivery_id = ?1), ?2, ?3, ?4, ?5)",
        id, attempt.at, attempt.duration_ms, attempt.status, attempt.detail);
    if (next_attempt_at) {
      return database.change("UPDATE deliveries SET next_attempt_at = ? WHERE id = ?", *next_attempt_at, id);
    }
    return database.change("UPDATE deliveries SET state = ?, next_attempt_at = NULL WHERE id = ?", state, id);
  });
}

std::vector<Delivery> DeliveryStore::of_job(const std::string& job_id) {
  return transactions_.read(
      [&](sql::Database& database) { return read_deliveries(database, " WHERE job_id = ? ORDER BY id", job_id); });
}

bool DeliveryStore::redeliver(const std::string& job_id, const std::string& id, std::int64_t now) {
  return transactions_.change(
             "UPDATE deliveries SET state = 'pending', next_attempt_at = ? WHERE id = ? AND job_id = ?", now, id,
             job_id) == 1;
}

void DeliveryStore::delete_before(std::int64_t then) {
  transactions_.change("DELETE FROM deliveries WHERE state <> 'pending' AND created_at < ?", then);
}

}  // namespace queue
