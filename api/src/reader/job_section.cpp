#include <array>
#include <string>

#include "api/src/reader/fields.h"
#include "api/src/reader/sections.h"

namespace api {
namespace {

void read_labels(Reading& reading, const Cursor& at, std::map<std::string, std::string>& labels) {
  if (!within_limit(reading, at, "labels", reading.limits.document.labels)) return;
  for_each_member(reading, at, [&](const Cursor& member) {
    const auto [place, is_new] = labels.emplace(member.key, std::string());
    if (!is_new) {
      add_issue(reading, member, "duplicate_key", quoted(member.key) + " is written twice");
    } else if (has_control_characters(member.key)) {
      add_issue(reading, member, "malformed", "a label must not have control characters");
    } else {
      read(reading, member, Name{place->second});
    }
  });
}

constexpr std::array<Word<CacheUse>::Meaning, 3> cache_words = {
    {{"use", CacheUse::use}, {"refresh", CacheUse::refresh}, {"off", CacheUse::off}}};

constexpr std::int64_t expires_in_max_s = 315'360'000;  // ten years: longer is meant to be for ever

}  // namespace

void read_job(Reading& reading, const Cursor& at) {
  JobRequest& job = reading.document.job;
  Fields fields(reading, at, "the job");
  fields.optional("name", Name{job.name});
  if (const auto labels = fields.take("labels")) read_labels(reading, *labels, job.labels);
  fields.optional("priority", Integer<int>{job.priority, 0, 100});
  fields.optional("max_attempts", Integer<int>{job.max_attempts, 1, 10});
  fields.optional("run_after", Time{job.run_after});
  const auto deadline = fields.take("deadline");
  if (deadline && read(reading, *deadline, Time{job.deadline}) && job.run_after && *job.deadline <= *job.run_after) {
    add_issue(reading, *deadline, "conflict", "must be later than run_after");
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
