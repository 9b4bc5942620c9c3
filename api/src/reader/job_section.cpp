#include "api/src/reader/fields.h"
#include "api/src/reader/issue_text.h"
#include "api/src/reader/sections.h"

namespace api {

template <>
inline constexpr Word<CacheUse> words<CacheUse>[] = {
    {"use", CacheUse::use}, {"refresh", CacheUse::refresh}, {"off", CacheUse::off}};

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
  if (const auto webhook = fields.take("webhook")) read_webhook(reading, *webhook, job.webhook.emplace());
  fields.finish();
}

}  // namespace api
