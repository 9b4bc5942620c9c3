/// Instructions for the service: the job and its webhook.

#include <algorithm>
#include <string>
#include <string_view>

#include "api/reader/fields.h"
#include "api/reader/issue_text.h"
#include "api/reader/request.h"
#include "api/src/reader/sections.h"

namespace api {

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
         std::ranges::all_of(rest, [](char c) { return c > ' ' && c < '\x7f' && c != '\\'; });
}

bool read_url(Reading& reading, const Cursor& at, std::string& url) {
  if (!expect_string(reading, at, "a URL as text")) return false;
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
    if (std::ranges::find(events, event) != events.end()) {
      add_issue(reading, element, "duplicate_value", quoted(event) + " is written twice");
    } else {
      events.emplace_back(event);
    }
  });
  if (is_list && at.node->size == 0) add_issue(reading, at, "wrong_length", "must name at least one event");
}

}  // namespace

bool read(Reading& reading, const Cursor& at, Webhook& webhook) {
  if (!reading.limits.webhooks)
    return add_issue(reading, at, "unsupported",
                     "this service sends no webhooks: it was started without the option --webhook-secret-file");
  Fields fields(reading, at, "a webhook");
  if (const auto url = fields.take_required("url")) read_url(reading, *url, webhook.url);
  if (const auto events = fields.take("events")) read_events(reading, *events, webhook.events);
  fields.finish();
  return static_cast<bool>(fields);
}

bool read_labels(Reading& reading, const Cursor& at, bool null_allowed,
                 std::map<std::string, std::optional<std::string>>& labels) {
  if (!within_limit(reading, at, "labels", reading.limits.document.labels)) return false;
  return for_each_member(reading, at, [&](const Cursor& member) {
    const auto [place, is_new] = labels.emplace(member.key, std::nullopt);
    if (!is_new) {
      add_issue(reading, member, "duplicate_key", quoted(member.key) + " is written twice");
    } else if (has_control_characters(member.key)) {
      add_issue(reading, member, "malformed", "a label must not have control characters");
    } else if (!null_allowed || member.node->kind != json::Kind::null) {
      read(reading, member, place->second);
    }
  });
}

bool read(Reading& reading, const Cursor& at, std::map<std::string, std::string>& labels) {
  std::map<std::string, std::optional<std::string>> values;
  const bool is_object = read_labels(reading, at, false, values);
  for (auto& [name, value] : values) labels.emplace(name, std::move(value).value_or(""));
  return is_object;
}

bool read(Reading& reading, const Cursor& at, JobRequest& job) {
  Fields fields(reading, at, "the job");
  read_all_fields(fields, job);
  if (job.run_after && job.deadline && *job.deadline <= *job.run_after)
    fields.add_issue("deadline", "conflict", "must be later than run_after");
  fields.finish();
  return static_cast<bool>(fields);
}

}  // namespace api
