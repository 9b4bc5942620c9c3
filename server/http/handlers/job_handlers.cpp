#include <charconv>
#include <utility>

#include "api/validation_json.h"
#include "server/http/handlers/handlers.h"
#include "server/http/negotiation.h"
#include "server/resources/job_json.h"

namespace http {
namespace {

constexpr int list_default = 50, list_max = 200;  // 200 jobs are half a megabyte of JSON: some milliseconds

struct ListQuery {
  queue::JobFilter filter;
  std::string cursor;
  int limit = list_default;
};

std::string read_limit(const std::string& text, int& limit) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), limit);
  const bool whole = error == std::errc{} && end == text.data() + text.size();
  if (whole && limit >= 1 && limit <= list_max) return {};
  return "limit must be 1.." + std::to_string(list_max);
}

/// The mistakes of all parameters, as one sentence; empty when the query is good.
std::string read_list_query(const Pairs& pairs, ListQuery& query) {
  std::string errors;
  const auto complain = [&](const std::string& sentence) {
    if (!sentence.empty()) errors += (errors.empty() ? "" : "; ") + sentence;
  };
  Pairs seen;
  for (const auto& [name, value] : pairs) {
    for (const auto& [earlier, unused] : seen) {
      if (earlier == name && name != "label") complain(name + " is given twice");
    }
    seen.emplace_back(name, value);
    if (name == "state") {
      query.filter.state = queue::job_state(value);
      if (!query.filter.state) complain("state must be queued, running, succeeded, failed or cancelled");
    } else if (name == "label") {
      const std::size_t colon = value.find(':');
      if (colon == 0 || colon == std::string::npos) {
        complain("label must be NAME:VALUE");
      } else if (!query.filter.labels.emplace(value.substr(0, colon), value.substr(colon + 1)).second) {
        complain("label " + value.substr(0, colon) + " is given twice");
      }
    } else if (name == "batch") {
      query.filter.batch = value;
      if (!is_id(value)) complain("batch must be the id of a batch");
    } else if (name == "q") {
      query.filter.text = value;
    } else if (name == "limit") {
      complain(read_limit(value, query.limit));
    } else if (name == "cursor") {
      query.cursor = value;
      if (value.size() != 36) complain("cursor must be a next_cursor");
    }
  }
  return errors;
}

}  // namespace

Answer submit_job(Request& request, const ApiContext& front) {
  auto scene = take_work(request, front);
  if (!scene) return problem_reply(scene.error(), request.id);
  auto idempotency = idempotency_of(request, scene->document, front);
  if (!idempotency) return problem_reply(idempotency.error(), request.id);
  queue::Submission submission = submission_of(request, std::move(*scene), front);
  do_once(submission, std::move(*idempotency), front);
  const auto submitted = front.queue.submission.submit(std::move(submission));
  if (!submitted) return problem_reply(problem_of(submitted.error()), request.id);
  return submission_reply(request, *submitted, front);
}

Answer validate_job(Request& request, const ApiContext& front) {
  auto scene = take_scene(request, front);
  Reply reply;
  reply.content_type = "application/json";
  if (scene) {
    reply.body = api::write_valid(scene->parsed.scene, front.seconds_per_work());
  } else if (scene.error().failure == Failure::bad_scene) {
    reply.body = api::write_invalid(scene.error().errors);
  } else {
    return problem_reply(scene.error(), request.id);
  }
  return reply;
}

Answer list_jobs(Request& request, const ApiContext& front) {
  ListQuery query;
  const std::string errors = read_list_query(request.head.query, query);
  if (!errors.empty()) return problem_reply({Failure::bad_query, errors, {}}, request.id);
  queue::JobPage page = front.queue.queries.list(query.filter, query.cursor, query.limit);
  std::vector<queue::JobView> views;
  views.reserve(page.items.size());
  for (queue::Job& job : page.items) {
    const double progress = job.state == queue::JobState::succeeded ? 1 : front.queue.queries.progress(job.id);
    views.push_back({std::move(job), progress});
  }
  Reply reply;
  reply.content_type = "application/json";
  reply.body = resources::write_job_list(views, page.next_cursor, front.clock());
  return reply;
}

Answer cancel_job(Request& request, const ApiContext& front) {
  const auto view = find_job(request, front);
  if (!view) return problem_reply(view.error(), request.id);
  const std::string& id = view->job.id;
  const queue::CancelOutcome outcome = front.queue.lifecycle.cancel(id);
  const auto after = front.queue.queries.find(id);
  if (outcome == queue::CancelOutcome::unknown || !after) return problem_reply(no_such_job(id), request.id);
  if (outcome == queue::CancelOutcome::already_ended) {
    const std::string state = queue::name_of(after->job.state);
    return problem_reply({Failure::job_ended, "job " + id + " has ended, it is " + state, {}}, request.id);
  }
  return job_reply(202, *after, front);
}

Answer remove_job(Request& request, const ApiContext& front) {
  const auto view = find_job(request, front);
  if (!view) return problem_reply(view.error(), request.id);
  const std::string& id = view->job.id;
  switch (front.queue.lifecycle.remove(id)) {
    case queue::RemoveOutcome::running:
      return problem_reply({Failure::job_running, "job " + id + " is running; cancel it first", {}}, request.id);
    case queue::RemoveOutcome::unknown:
      return problem_reply(no_such_job(id), request.id);
    case queue::RemoveOutcome::removed:
      break;
  }
  Reply reply;
  reply.status = 204;
  reply.job_id = id;
  return reply;
}

Answer get_deliveries(Request& request, const ApiContext& front) {
  const auto view = find_job(request, front);
  if (!view) return problem_reply(view.error(), request.id);
  Reply reply;
  reply.content_type = "application/json";
  reply.body = resources::write_deliveries(front.deliveries(view->job.id));
  reply.job_id = view->job.id;
  return reply;
}

}  // namespace http
