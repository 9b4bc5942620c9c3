/// Instructions for the service: the job and its webhook.

#include <algorithm>
#include <string>
#include <string_view>

#include "api/src/reader/fields.h"
#include "api/src/reader/issue_text.h"
#include "api/src/reader/sections.h"

namespace api {

constexpr auto words_of(CacheUse first) { return tracer::in_order(first, {"use", "refresh", "off"}); }

namespace {

constexpr std::size_t url_bytes_max = 2048;  // the same as for request targets

/// True for an absolute http or https URL as every server accepts it; other errors appear when it is called.
/// Credentials are refused because the URL is logged.
bool is_web_address(std::string_view url) {
  const std::string_view scheme = url.starts_with("https://") ? "https://" : "http://";
  if (!url.starts_with(scheme)) return false;
  const std::string_view rest = url.substr(scheme.size());
  const std::string_view authority = rest.substr(0, rest.find_first_of("/?#"));
  return !authority.empty() && authority.find('@') == std::string_view::npos &&
         rest.find('#') == std::string_view::npos &&
         std::all_of(rest.begin(), rest.end(), [](char c) { return c > ' ' && c < '\x7f' && c != '\\'; });
}

bool read_url(Reading& reading, const Cursor& at, std::string& url) {
  if (at.node->kind != json::Kind::string) return add_wrong_type(reading, at, "a URL as text");
  url = at.node->string();
  if (url.size() > url_bytes_max) return add_limit_exceeded(reading, at, "url_bytes_max", url_bytes_max, url.size());
  return is_web_address(url) ||
         add_issue(reading, at, "malformed",
                   "must be an http or https URL without user, password or fragment, got " + quoted(at.node->string()));
}

void read_events(Reading& reading, const Cursor& at, std::vector<std::string>& events) {
  constexpr Word<std::string_view> states[] = {
      {"succeeded", "succeeded"}, {"failed", "failed"}, {"cancelled", "cancelled"}};
  events.clear();
  const bool is_list = for_each_element(reading, at, [&](const Cursor& element) {
    std::string_view event;
    if (!read(reading, element, OneOf<std::string_view>{event, states})) return;
    if (std::find(events.begin(), events.end(), event) != events.end()) {
      add_issue(reading, element, "duplicate_value", quoted(event) + " is written twice");
    } else {
      events.emplace_back(event);
    }
  });
  if (is_list && at.node->size == 0) add_issue(reading, at, "wrong_length", "must name at least one event");
}

}  // namespace

void read_webhook(Reading& reading, const Cursor& at, Webhook& webhook) {
  if (!reading.limits.webhooks) {
    add_issue(reading, at, "unsupported",
              "this service sends no webhooks: it was started without the option --webhook-secret-file");
    return;
  }
  Fields fields(reading, at, "a webhook");
  if (const auto url = fields.take_required("url")) read_url(reading, *url, webhook.url);
  if (const auto events = fields.take("events")) read_events(reading, *events, webhook.events);
  fields.finish();
}

void read_labels(Reading& reading, const Cursor& at, bool null_allowed,
                 std::map<std::string, std::optional<std::string>>& labels) {
  if (!within_limit(reading, at, "labels", reading.limits.document.labels)) return;
  for_each_member(reading, at, [&](const Cursor& member) {
    const auto [place, is_new] = labels.emplace(member.key, std::nullopt);
    if (!is_new) {
      add_issue(reading, member, "duplicate_key", quoted(member.key) + " is written twice");
    } else if (has_control_characters(member.key)) {
      add_issue(reading, member, "malformed", "a label must not have control characters");
    } else if (!null_allowed || member.node->kind != json::Kind::null) {
      read(reading, member, Name{place->second.emplace()});
    }
  });
}

void read_job(Reading& reading, const Cursor& at) {
  constexpr std::int64_t expires_in_max_s = 315'360'000;  // ten years; without the field, images are kept
  JobRequest& job = reading.document.job;
  Fields fields(reading, at, "the job");
  fields.optional("name", Name{job.name});
  std::map<std::string, std::optional<std::string>> labels;
  if (const auto field = fields.take("labels")) read_labels(reading, *field, false, labels);
  for (auto& [name, value] : labels) job.labels.emplace(name, std::move(value).value_or(""));
  fields.optional("priority", Integer<int>{job.priority, 0, 100});
  fields.optional("max_attempts", Integer<int>{job.max_attempts, 1, 10});
  fields.optional("run_after", Time{job.run_after});
  const auto deadline = fields.take("deadline");
  if (deadline && read(reading, *deadline, Time{job.deadline}) && job.run_after && *job.deadline <= *job.run_after)
    add_issue(reading, *deadline, "conflict", "must be later than run_after");
  fields.optional("expires_in", Integer<std::optional<std::int64_t>>{job.expires_in_s, 1, expires_in_max_s});
  fields.optional("cache", job.cache);
  fields.optional("keep", job.keep);
  if (const auto webhook = fields.take("webhook")) read_webhook(reading, *webhook, job.webhook.emplace());
  fields.finish();
}

}  // namespace api
