/// Who is to be told of a job's end.

#include <algorithm>
#include <string>
#include <string_view>

#include "api/src/reader/fields.h"
#include "api/src/reader/sections.h"

namespace api {
namespace {

constexpr std::size_t url_bytes_max = 2048;  // as of our own targets

/// What every server takes for an absolute URL: the rest is seen when it is called. Credentials would stand in logs.
bool is_web_address(std::string_view url) {
  const std::string_view scheme = url.starts_with("https://") ? "https://" : "http://";
  if (!url.starts_with(scheme)) return false;
  const std::string_view rest = url.substr(scheme.size());
  const std::string_view authority = rest.substr(0, rest.find_first_of("/?#"));
  return !authority.empty() && authority.find('@') == std::string_view::npos &&
         rest.find('#') == std::string_view::npos &&
         std::all_of(rest.begin(), rest.end(), [](char c) { return c > ' ' && c < '\x7f' && c != '\\'; });
}

void read_url(Reading& reading, const Cursor& at, std::string& url) {
  if (at.node->kind != json::Kind::string) return add_wrong_type(reading, at, "a URL as text");
  const std::string_view text = at.node->string();
  if (text.size() > url_bytes_max) {
    add_issue(reading, at, "limit_exceeded",
              "the limit url_bytes_max is " + std::to_string(url_bytes_max) + ", got " + std::to_string(text.size()));
  } else if (!is_web_address(text)) {
    add_issue(reading, at, "malformed",
              "must be an http or https URL without user, password or fragment, got " + quoted(text));
  } else {
    url = text;
  }
}

void read_events(Reading& reading, const Cursor& at, std::vector<std::string>& events) {
  constexpr Word<std::string_view>::Meaning states[] = {
      {"succeeded", "succeeded"}, {"failed", "failed"}, {"cancelled", "cancelled"}};
  events.clear();
  const bool is_list = for_each_element(reading, at, [&](const Cursor& element) {
    std::string_view event;
    if (!read(reading, element, Word<std::string_view>{event, "events", states})) return;
    if (std::find(events.begin(), events.end(), event) != events.end()) {
      return add_issue(reading, element, "duplicate_value", quoted(event) + " is written twice");
    }
    events.emplace_back(event);
  });
  if (is_list && at.node->size == 0) add_issue(reading, at, "wrong_length", "must name at least one event");
}

}  // namespace

void read_webhook(Reading& reading, const Cursor& at, std::optional<Webhook>& webhook) {
  if (!reading.limits.webhooks) {
    return add_issue(reading, at, "unsupported",
                     "this service sends no webhooks: it was started without the option --webhook-secret-file");
  }
  Webhook& read = webhook.emplace();
  Fields fields(reading, at, "a webhook");
  if (const auto url = fields.take("url")) {
    read_url(reading, *url, read.url);
  } else if (fields) {
    fields.report_missing_field("url");
  }
  if (const auto events = fields.take("events")) read_events(reading, *events, read.events);
  fields.finish();
}

}  // namespace api
