/// Many jobs of one scene at once.

#include <algorithm>
#include <array>
#include <cstdio>
#include <utility>

#include "api/estimate.h"
#include "server/http/handlers/handlers.h"
#include "server/http/handlers/tar.h"
#include "server/resources/queue_json.h"

namespace http {
namespace {

constexpr int page_size = 1000;  // jobs read from the store at once

tracer::Result<queue::BatchState, Problem> find_batch(const Request& request, const ApiContext& front) {
  const std::string& id = request.parameters.front();
  if (!is_id(id)) return Problem{Failure::batch_not_found, "that is no batch id; ids are lower-case UUIDs", {}};
  auto state = front.queue.queries.find_batch(id);
  if (!state) return Problem{Failure::batch_not_found, "there is no batch " + id, {}};
  return std::move(*state);
}

Reply batch_reply(int status, const queue::BatchState& state) {
  Reply reply;
  reply.status = status;
  reply.content_type = "application/json";
  reply.body = resources::write_batch(state);
  if (status == 202) reply.headers.emplace_back("Location", "/v1/batches/" + state.batch.id);
  return reply;
}

/// The batch as it is after a change of it.
Answer changed_reply(const Request& request, const ApiContext& front) {
  const auto after = find_batch(request, front);
  if (!after) return problem_reply(after.error(), request.id);
  return batch_reply(202, *after);
}

std::int64_t count(const queue::BatchState& state, queue::JobState which) {
  const auto found = state.jobs.find(which);
  return found == state.jobs.end() ? 0 : found->second;
}

/// "00012.16.png": the job's place in the batch, and the image's name without "image".
std::string file_name(const queue::Job& job, const queue::Artifact& artifact) {
  std::array<char, 16> place{};
  std::snprintf(place.data(), place.size(), "%05d", job.batch_index);
  return place.data() + artifact.name.substr(std::min(artifact.name.find('.'), artifact.name.size()));
}

/// The images that there are, in the batch's order.
std::vector<TarEntry> images_of(const std::string& batch, const ApiContext& front) {
  std::vector<TarEntry> entries;
  queue::JobFilter filter;
  filter.batch = batch;
  filter.state = queue::JobState::succeeded;
  std::string cursor;
  do {
    const queue::JobPage page = front.queue.queries.list(filter, cursor, page_size);
    for (const queue::Job& job : page.items) {
      for (const queue::Artifact& artifact : job.artifacts) {
        entries.push_back({file_name(job, artifact), artifact.bytes, job.ended_at.value_or(0), artifact});
      }
    }
    cursor = page.next_cursor;
  } while (!cursor.empty());
  std::stable_sort(entries.begin(), entries.end(),
                   [](const TarEntry& a, const TarEntry& b) { return a.name < b.name; });
  return entries;
}

/// The jobs of a body; none where one of them cannot be rendered here.
tracer::Result<queue::BatchSubmission, Problem> batch_of(const Request& request, const std::string& body,
                                                         const ApiContext& front) {
  queue::BatchSubmission submission;
  std::vector<tracer::Issue> refused;
  const auto take = [&](std::string document, api::Document parsed, std::string canonical) {
    if (refused.empty()) refused = refused_here(parsed.scene, api::estimated_memory_bytes(parsed.scene), front);
    submission.jobs.push_back(
        submission_of(request, {std::move(document), std::move(parsed), std::move(canonical)}, front));
  };
  const auto read = api::parse_batch(body, front.batch_limits, take);
  if (!read) return problem_of(read.error());
  if (!refused.empty()) {
    api::Refusal refusal;
    for (tracer::Issue& issue : refused) issue.pointer.insert(0, "/scene");
    refusal.issues = std::move(refused);
    return problem_of(refusal);
  }
  submission.name = read->name;
  submission.max_failed = read->max_failed;
  submission.owner = request.owner;
  return submission;
}

}  // namespace

Answer submit_batch(Request& request, const ApiContext& front) {
  if (front.draining()) {
    return problem_reply({Failure::draining, "nothing was stored; try again when it is back", {}}, request.id);
  }
  const auto body = take_json(request, "a batch");
  if (!body) return problem_reply(body.error(), request.id);
  auto idempotency = idempotency_of(request, *body, front);
  if (!idempotency) return problem_reply(idempotency.error(), request.id);
  auto submission = batch_of(request, *body, front);
  if (!submission) return problem_reply(submission.error(), request.id);
  submission->idempotency = std::move(*idempotency);
  submission->write_reply = [](const queue::BatchState& state) -> queue::FirstReply {
    return {202, "/v1/batches/" + state.batch.id, resources::write_batch(state)};
  };
  const auto submitted = front.queue.submission.submit_batch(std::move(*submission));
  if (!submitted) return problem_reply(problem_of(submitted.error()), request.id);
  if (submitted->replayed) return replayed_reply(*submitted->replayed);
  return batch_reply(202, submitted->state);
}

Answer get_batch(Request& request, const ApiContext& front) {
  const auto state = find_batch(request, front);
  if (!state) return problem_reply(state.error(), request.id);
  Reply reply = batch_reply(200, *state);
  reply.headers.emplace_back("Cache-Control", "no-cache");
  return reply;
}

Answer cancel_batch(Request& request, const ApiContext& front) {
  const auto state = find_batch(request, front);
  if (!state) return problem_reply(state.error(), request.id);
  if (count(*state, queue::JobState::queued) + count(*state, queue::JobState::running) == 0) {
    return problem_reply({Failure::batch_ended, "all jobs of the batch have ended", {}}, request.id);
  }
  front.queue.lifecycle.cancel_batch(state->batch.id);
  return changed_reply(request, front);
}

Answer retry_batch(Request& request, const ApiContext& front) {
  const auto state = find_batch(request, front);
  if (!state) return problem_reply(state.error(), request.id);
  if (front.draining()) {
    return problem_reply({Failure::draining, "nothing was changed; try again later", {}}, request.id);
  }
  if (front.queue.lifecycle.retry_batch(state->batch.id) == 0) {
    return problem_reply({Failure::batch_not_failed, "no job of the batch failed or was cancelled", {}}, request.id);
  }
  return changed_reply(request, front);
}

Answer get_batch_artifacts(Request& request, const ApiContext& front) {
  const auto state = find_batch(request, front);
  if (!state) return problem_reply(state.error(), request.id);
  const std::string& id = state->batch.id;
  std::vector<TarEntry> entries = images_of(id, front);
  if (entries.empty()) {
    return problem_reply({Failure::image_not_found, "no job of batch " + id + " has an image (yet)", {}}, request.id);
  }
  Reply reply;
  reply.content_type = "application/x-tar";
  reply.headers.emplace_back("Content-Disposition", "attachment; filename=\"" + id + ".tar\"");
  reply.headers.emplace_back("Cache-Control", "no-cache");
  reply.source = tar_of(std::move(entries),
                        [&queries = front.queue.queries](const queue::Artifact& a) { return queries.open(a); });
  return reply;
}

}  // namespace http
