/// A job as it is, or as soon as it is otherwise: long polls, and submitters who like to wait. Waiting holds no thread.

#include <algorithm>
#include <charconv>

#include "server/http/handlers/handlers.h"
#include "server/http/negotiation.h"

namespace http {
namespace {

using SteadyTime = std::chrono::steady_clock::time_point;

SteadyTime after(std::chrono::seconds wait) { return std::chrono::steady_clock::now() + wait; }

Reply job_with_etag(const queue::JobView& view, const std::string& etag, const ApiContext& front) {
  Reply reply = job_reply(200, view, front);
  reply.headers.emplace_back("ETag", etag);
  reply.headers.emplace_back("Cache-Control", "no-cache");
  return reply;
}

Reply not_modified(const std::string& etag, const std::string& id) {
  Reply reply;
  reply.status = 304;
  reply.headers = {{"ETag", etag}, {"Cache-Control", "no-cache"}};
  reply.job_id = id;
  return reply;
}

/// A reader of a job, who may have time.
struct Look {
  std::string id, request_id;
  std::optional<std::string> known;  ///< the If-None-Match
  SteadyTime deadline;
  std::shared_ptr<queue::Events::Listener> listener;  ///< null: does not wait
};

/// Those who know a state wait for another one, the others for the end.
Answer answer(const Look& look, const queue::JobView& view, bool timed_out, const ApiContext& front) {
  const std::string etag = etag_of(view);
  const bool known = look.known && none_match_names(*look.known, etag);
  const bool waits = look.listener && !timed_out && (look.known ? known : !queue::ended(view.job.state));
  if (!waits) return known ? not_modified(etag, look.id) : job_with_etag(view, etag, front);

  const auto watch = [listener = look.listener](std::function<void()> wake) -> std::function<void()> {
    listener->on_news(std::move(wake));
    return [listener] { listener->on_news([] {}); };
  };
  const auto resume = [look, front](bool late) -> Answer {
    look.listener->take(SIZE_MAX);  // before the job is looked at: what comes later wakes again
    const auto now = front.queue.queries.find(look.id);
    if (!now) return problem_reply(no_such_job(look.id), look.request_id);
    return answer(look, *now, late, front);
  };
  return DeferredReply{look.deadline, watch, resume};
}

/// The parameter wait, in seconds; nothing when it is none.
std::optional<std::chrono::seconds> read_wait(const Pairs& query) {
  int seconds = 0;
  for (const auto& [name, text] : query) {
    const char* const end = text.data() + text.size();
    const auto [stop, error] = std::from_chars(text.data(), end, seconds);
    if (error != std::errc{} || stop != end || query.size() > 1) return std::nullopt;
  }
  const std::chrono::seconds wait(seconds);
  return wait >= std::chrono::seconds(0) && wait <= wait_max ? std::optional(wait) : std::nullopt;
}

/// Answers the job when it has ended, or has not by then.
Answer when_ended(const queue::JobView& view, SteadyTime deadline, const std::string& applied,
                  const std::string& request_id, const ApiContext& front, bool timed_out) {
  const bool ended = queue::ended(view.job.state);
  if (ended || timed_out) {
    Reply reply = job_reply(ended ? 200 : 202, view, front);
    if (ended) reply.headers.emplace_back("Content-Location", "/v1/jobs/" + view.job.id);
    reply.headers.emplace_back("Preference-Applied", applied);
    return reply;
  }
  const std::string id = view.job.id;
  const auto watch = [front, id](std::function<void()> wake) -> std::function<void()> {
    const std::uint64_t token = front.queue.waiters.when_ended(id, std::move(wake));
    return [front, token] { front.queue.waiters.cancel(token); };
  };
  const auto resume = [=](bool late) -> Answer {
    const auto now = front.queue.queries.find(id);
    if (!now) return problem_reply(no_such_job(id), request_id);
    return when_ended(*now, deadline, applied, request_id, front, late);
  };
  return DeferredReply{deadline, watch, resume};
}

}  // namespace

Answer get_job(Request& request, const ApiContext& front) {
  const auto wait = read_wait(request.head.query);
  if (!wait) {
    const std::string most = std::to_string(wait_max.count());
    return problem_reply({Failure::bad_query, "wait must be whole seconds 0.." + most + ", once", {}}, request.id);
  }
  Look look{request.parameters.front(), request.id, {}, after(*wait), nullptr};
  if (const auto known = request.head.header("if-none-match")) look.known = *known;
  if (wait->count() > 0) {
    // Listening begins before the job is looked at, so no change is missed.
    look.listener = front.events.listen(look.id, {});
    if (!look.listener) return problem_reply(too_many_listeners(front), request.id);
  }
  const auto view = find_job(request, front);
  if (!view) return problem_reply(view.error(), request.id);
  return answer(look, *view, false, front);
}

Answer submission_reply(const Request& request, const queue::Submitted& submitted, const ApiContext& front) {
  if (submitted.replayed) return replayed_reply(*submitted.replayed);
  if (submitted.from_cache) {
    Reply reply = job_reply(200, submitted.view, front);
    reply.headers.emplace_back("X-Cache", "hit");
    return reply;
  }
  std::string preferences;
  for (const auto& [name, value] : request.head.headers) {
    if (name == "prefer") preferences += (preferences.empty() ? "" : ",") + value;
  }
  const auto preferred = preferred_wait(preferences);
  if (!preferred || preferred->count() == 0) return job_reply(202, submitted.view, front);
  const std::chrono::seconds wait = std::min(*preferred, wait_max);
  const std::string applied = "wait=" + std::to_string(wait.count());
  return when_ended(submitted.view, after(wait), applied, request.id, front, false);
}

}  // namespace http
