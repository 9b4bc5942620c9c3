/// Batches: many jobs of one scene.

#include <algorithm>
#include <array>
#include <cstdio>
#include <set>
#include <utility>

#include "api/estimate.h"
#include "server/http/handlers/handlers.h"
#include "server/resources/resource_json.h"

namespace http::handlers {
namespace {

constexpr int page_size = 1000;  // jobs read from the store at once

Reply accepted_reply(const queue::BatchState& state) {
  Reply reply = json_reply(202, resources::write(state));
  reply.headers.emplace_back("Location", "/v1/batches/" + state.batch.id);
  return reply;
}

/// The batch after a change.
Answer changed_reply(const std::string& id, const ApiContext& context) {
  const auto after = find_batch(id, context);
  if (!after) return after.error();
  return accepted_reply(*after);
}

/// "00012.16.png": index of the job in the batch, and the name of the artifact without "image".
std::string file_name(const queue::Job& job, const queue::Artifact& artifact) {
  std::array<char, 16> index{};
  std::snprintf(index.data(), index.size(), "%05d", job.batch_index);
  return index.data() + artifact.name.substr(std::min(artifact.name.find('.'), artifact.name.size()));
}

/// Parses the jobs of a body. Problem if one of them cannot be rendered here.
tracer::Result<queue::BatchSubmission, Problem> batch_of(const Request& request, const std::string& body,
                                                         const ApiContext& context) {
  queue::BatchSubmission submission;
  std::optional<Problem> problem;
  std::set<std::string> checked_assets;
  const auto take = [&](api::Frame frame) {
    tracer::Scene& scene = frame.document.scene;
    std::erase_if(scene.assets, [&](const tracer::Asset& asset) { return !checked_assets.insert(asset.name).second; });
    const std::uint64_t memory_bytes = api::estimated_memory_bytes(scene, frame.content);
    if (!problem) problem = deployment_problem(scene, memory_bytes, "/scene", context);
    queue::Submission fresh = submission_of(
        request, {std::move(frame.patch), std::move(frame.document), std::move(frame.digests), frame.content}, context);
    queue::Job& job = fresh.job;
    job.variation = std::move(frame.variation);
    std::vector<std::string>& uploads = submission.scene.assets;
    uploads.insert(uploads.end(), job.assets.begin(), job.assets.end());
    job.assets.clear();
    submission.jobs.push_back(std::move(fresh));
  };
  auto parsed_batch = api::parse_batch(body, context.batch_limits, take);
  if (!parsed_batch) return problem_of(parsed_batch.error());
  if (problem) return *std::move(problem);
  submission.scene.document = std::move(parsed_batch->scene);
  queue::Batch& batch = submission.batch;
  batch.name = parsed_batch->name;
  batch.sweep = std::move(parsed_batch->sweep);
  batch.max_failed = parsed_batch->max_failed;
  batch.owner = request.owner();
  return submission;
}

Answer submit_batch(Request& request, const ApiContext& context) {
  if (auto problem = refuse_if_draining(context)) return *problem;
  const auto body = take_json(request, "a batch");
  if (!body) return body.error();
  auto idempotency = idempotency_of(request, *body);
  if (!idempotency) return idempotency.error();
  auto submission = batch_of(request, *body, context);
  if (!submission) return submission.error();
  submission->idempotency = std::move(*idempotency);
  submission->write_reply = [](const queue::BatchState& state) -> queue::FirstReply {
    return {202, "/v1/batches/" + state.batch.id, resources::write(state)};
  };
  const auto submitted = context.queue.submission.submit_batch(std::move(*submission));
  if (!submitted) return problem_of(submitted.error());
  if (submitted->replayed) return replayed_reply(*submitted->replayed);
  return accepted_reply(submitted->state);
}

Answer get_batch(Request&, const queue::BatchState& state, const ApiContext&) {
  return json_reply(200, resources::write(state), "no-cache");
}

Answer list_batches(Request& request, const ApiContext& context) {
  const auto query = read_list_query(request.head.query);
  if (!query) return query.error();
  return json_reply(200, resources::write(context.queue.queries.list_batches(query->cursor, query->limit)));
}

Answer remove_batch(Request&, const queue::BatchState& state, const ApiContext& context) {
  const std::int64_t waiting = state.count(queue::JobState::queued) + state.count(queue::JobState::running);
  // Also if a retry came between.
  if (waiting > 0 || !context.queue.lifecycle.remove_batch(state.batch.id)) {
    return Problem{
        failures::batch_running,
        std::to_string(waiting) + " jobs of the batch have not ended; cancel it first, and wait for its end"};
  }
  return Reply{.status = 204};
}

Answer cancel_batch(Request&, const queue::BatchState& state, const ApiContext& context) {
  if (state.count(queue::JobState::queued) + state.count(queue::JobState::running) == 0) {
    return Problem{failures::batch_ended, "all jobs of the batch have ended"};
  }
  context.queue.lifecycle.cancel_batch(state.batch.id);
  return changed_reply(state.batch.id, context);
}

Answer retry_batch(Request&, const queue::BatchState& state, const ApiContext& context) {
  if (auto problem = refuse_if_draining(context)) return *problem;
  if (context.queue.lifecycle.retry_batch(state.batch.id) == 0) {
    return Problem{failures::batch_not_failed, "no job of the batch failed or was cancelled"};
  }
  return changed_reply(state.batch.id, context);
}

Answer get_batch_artifacts(Request&, const queue::BatchState& state, const ApiContext& context) {
  const std::string& id = state.batch.id;
  std::vector<TarEntry> entries = images_of(id, context);
  if (entries.empty()) {
    return Problem{failures::image_not_found, "no job of batch " + id + " has an image yet"};
  }
  const auto open = [&queries = context.queue.queries](const queue::Artifact& a) {
    return queries.open(a, /*verified=*/false);
  };
  return Reply{
      .content_type = "application/x-tar",
      .headers = {{"Content-Disposition", "attachment; filename=\"" + id + ".tar\""}, {"Cache-Control", "no-cache"}},
      .source = tar_of(std::move(entries), open)};
}

}  // namespace

std::vector<TarEntry> images_of(const std::string& batch, const ApiContext& context) {
  std::vector<TarEntry> entries;
  queue::JobFilter filter;
  filter.batch = batch;
  filter.state = queue::JobState::succeeded;
  std::string cursor;
  do {
    const queue::JobPage page = context.queue.queries.list(filter, cursor, page_size);
    for (const queue::Job& job : page.items) {
      for (const queue::Artifact& artifact : job.artifacts) {
        entries.push_back({file_name(job, artifact), artifact.bytes, job.ended_at.value_or(0), artifact});
      }
    }
    cursor = page.next_cursor;
  } while (!cursor.empty());
  std::ranges::stable_sort(entries, {}, &TarEntry::name);
  return entries;
}

tracer::Result<queue::BatchState, Problem> find_batch(const std::string& id, const ApiContext& context) {
  if (!is_id(id)) return Problem{failures::batch_not_found, "this is no batch id; ids are lower-case UUIDs"};
  auto state = context.queue.queries.find_batch(id);
  if (!state) return Problem{failures::batch_not_found, "there is no batch " + id};
  return std::move(*state);
}

Endpoints batch_endpoints() {
  return {{"POST", "/v1/batches", submit_batch, {.one_at_a_time = true}},
          {"GET", "/v1/batches", list_batches, {.query = {"limit", "cursor"}}},
          {"GET", "/v1/batches/{id}", get_batch},
          {"DELETE", "/v1/batches/{id}", remove_batch, {.one_at_a_time = true}},
          {"POST", "/v1/batches/{id}/cancel", cancel_batch, {.one_at_a_time = true}},
          {"POST", "/v1/batches/{id}/retry", retry_batch, {.one_at_a_time = true}},
          {"GET", "/v1/batches/{id}/artifacts.tar", get_batch_artifacts}};
}

}  // namespace http::handlers
