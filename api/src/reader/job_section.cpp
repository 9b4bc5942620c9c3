#include <algorithm>
#include <array>
#include <string>
#include <string_view>

#include "api/src/reader/fields.h"
#include "api/src/reader/sections.h"

namespace api {
namespace {

void read_labels(Reading& reading, const Cursor& at, std::map<std::string, std::string>& labels) {
  if (!within_limit(reading, at, "labels", reading.limits.document.labels)) return;
  for_each_member(reading, at, [&](const Cursor& member) {
    const auto [place, is_new] = labels.emplace(member.key, std::string());
    if (!is_new) {
      tell(reading, member, "duplicate_key", quoted(member.key) + " is written twice");
    } else if (has_control_characters(member.key)) {
      tell(reading, member, "malformed", "a label must not have control characters");
    } else {
      read(reading, member, Name{place->second});
    }
  });
}

constexpr std::array<Word<CacheUse>::Meaning, 3> cache_words = {
    {{"use", CacheUse::use}, {"refresh", CacheUse::refresh}, {"off", CacheUse::off}}};
constexpr std::array<Word<std::string_view>::Meaning, 3> event_words = {
    {{"succeeded", "succeeded"}, {"failed", "failed"}, {"cancelled", "cancelled"}}};

constexpr std::int64_t expires_in_max_s = 315'360'000;  // ten years: longer is meant to be for ever
constexpr std::size_t url_bytes_max = 2048;             // what proxies and servers take

/// Its scheme and its characters; whether anyone may be called there is decided when it is called.
void read_url(Reading& reading, const Cursor& at, std::string& url) {
  if (at.node->kind != json::Kind::string) return tell_wrong_type(reading, at, "a string");
  const std::string_view text = at.node->string();
  const bool printable = std::all_of(text.begin(), text.end(), [](char c) { return c > 0x20 && c < 0x7F; });
  const std::size_t scheme = text.starts_with("http://") ? 7 : text.starts_with("https://") ? 8 : 0;
  if (text.size() > url_bytes_max) {
    tell(reading, at, "limit_exceeded",
         "the limit url_bytes is " + std::to_string(url_bytes_max) + ", got " + std::to_string(text.size()));
  } else if (!printable || scheme == 0 || text.size() == scheme) {
    tell(reading, at, "malformed", "must be an http:// or https:// URL in printable ASCII");
  } else {
    url = text;
  }
}

void read_events(Reading& reading, const Cursor& at, std::vector<std::string>& events) {
  if (at.node->kind == json::Kind::array && at.node->size == 0) {
    return tell(reading, at, "wrong_length", "must name at least one event");
  }
  events.clear();
  for_each_element(reading, at, [&](const Cursor& element) {
    std::string_view event;
    if (!read(reading, element, Word<std::string_view>{event, "job.webhook.events", event_words})) return;
    if (std::find(events.begin(), events.end(), event) != events.end()) {
      return tell(reading, element, "conflict", quoted(event) + " is named twice");
    }
    events.emplace_back(event);
  });
}

void read_webhook(Reading& reading, const Cursor& at, std::optional<Webhook>& webhook) {
  webhook = Webhook{{}, {"succeeded", "failed", "cancelled"}};
  Fields fields(reading, at, "job.webhook", "a webhook");
  if (const auto url = fields.take("url")) {
    read_url(reading, *url, webhook->url);
  } else if (fields) {
    fields.tell_missing("url");
  }
  if (const auto events = fields.take("events")) read_events(reading, *events, webhook->events);
  fields.finish();
}

}  // namespace

void read_job(Reading& reading, const Cursor& at) {
  JobRequest& job = reading.document.job;
  Fields fields(reading, at, "job", "the job");
  fields.optional("name", Name{job.name});
  if (const auto labels = fields.take("labels")) read_labels(reading, *labels, job.labels);
  fields.optional("priority", Integer<int>{job.priority, 0, 100});
  fields.optional("max_attempts", Integer<int>{job.max_attempts, 1, 10});
  fields.optional("run_after", Time{job.run_after});
  const auto deadline = fields.take("deadline");
  if (deadline && read(reading, *deadline, Time{job.deadline}) && job.run_after && *job.deadline <= *job.run_after) {
    tell(reading, *deadline, "conflict", "must be later than run_after");
  }
  std::int64_t expires_in_s = 0;
  if (fields.optional("expires_in", Integer<std::int64_t>{expires_in_s, 1, expires_in_max_s})) {
    job.expires_in_s = expires_in_s;
  }
  fields.optional("cache", Word<CacheUse>{job.cache, "job.cache", cache_words});
  if (const auto webhook = fields.take("webhook")) read_webhook(reading, *webhook, job.webhook);
  fields.finish();
}

}  // namespace api
