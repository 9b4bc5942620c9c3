/// Waiting for changes of jobs: long polling, "Prefer: wait" of submissions, and streams of server-sent events. Waiting
/// and streaming occupy no thread.

#include <algorithm>
#include <cstdint>

#include "server/http/handlers/handlers.h"
#include "server/http/header_text.h"
#include "server/resources/resource_json.h"

namespace http {

std::string event_text(const queue::JobEvent& event) {
  using Kind = queue::JobEvent::Kind;
  const char* const name = event.kind == Kind::done ? "done" : (event.kind == Kind::progress ? "progress" : "state");
  // The data ends with a newline.
  return "id: " + std::to_string(event.number) + "\nevent: " + name + "\ndata: " + resources::write(event) + '\n';
}

}  // namespace http

namespace http::handlers {
namespace {

using Listener = queue::Events::Listener;

constexpr std::size_t chunk_bytes = 8192;  // output that the server holds for a slow client

/// Last-Event-ID: nothing if there is none, and a number without events if it is not one of this service.
std::optional<std::int64_t> last_event(const Request& request) {
  const auto header = request.head.header("last-event-id");
  if (!header || header->empty()) return std::nullopt;
  const auto number = parse_number<std::int64_t>(*header);
  return number && *number >= 0 ? number : -1;
}

Reply stream_reply(const std::shared_ptr<Listener>& listener, std::string beginning) {
  const auto take = [listener]() -> BodyStream::Chunk {
    auto [text, over] = listener->take(chunk_bytes);
    return {std::move(text), over};
  };
  const auto watch = [listener](std::function<void()> notify) { listener->on_news(std::move(notify)); };
  // Otherwise nginx delays events until it has many.
  return {.content_type = "text/event-stream",
          .headers = {{"Cache-Control", "no-store"}, {"X-Accel-Buffering", "no"}},
          .body = "retry: 2000\n\n" + std::move(beginning),
          .stream = std::make_shared<BodyStream>(BodyStream{take, watch, ": heartbeat\n\n"})};
}

/// The state of a job as an event.
queue::JobEvent current_state(const queue::JobView& view, std::int64_t number, std::int64_t now) {
  using Kind = queue::JobEvent::Kind;
  const Kind kind = queue::ended(view.job.state) ? Kind::done : Kind::state;
  return {number, kind, queue::summary_of(view.job), queue::name_of(view.job.state), view.progress, now};
}

struct JobPoll {
  std::string id;
  std::optional<std::string> if_none_match;
  Time deadline;
  std::shared_ptr<queue::Events::Listener> listener;  ///< null: no wait
};

/// With If-None-Match the poll waits for another state, otherwise for the end of the job.
Answer answer_poll(const JobPoll& poll, bool timed_out, const ApiContext& context) {
  const auto view = find_job(poll.id, context);
  if (!view) return view.error();
  const std::string etag = etag_of(*view);
  const bool is_known = none_match_names(poll.if_none_match, etag);
  const bool waits = poll.listener && !timed_out && (poll.if_none_match ? is_known : !queue::ended(view->job.state));
  if (!waits) {
    Reply reply = is_known ? Reply() : job_reply(200, *view, context);  // a known one is sent as 304
    reply.job_id = poll.id;
    reply.headers.emplace_back("ETag", etag);
    reply.headers.emplace_back("Cache-Control", "no-cache");
    return reply;
  }
  const auto watch = [listener = poll.listener](std::function<void()> notify) -> std::function<void()> {
    listener->on_news(std::move(notify));
    return [listener] { listener->on_news([] {}); };
  };
  const auto resume = [poll, &context](bool late) -> Answer {
    poll.listener->take(SIZE_MAX);  // before the job is read, so that later events notify again
    return answer_poll(poll, late, context);
  };
  return DeferredReply{poll.deadline, watch, resume};
}

/// The parameter wait, in seconds; nothing if it is invalid.
std::optional<std::chrono::seconds> read_wait(const Pairs& query) {
  if (query.empty()) return std::chrono::seconds(0);
  const auto seconds = parse_number<int>(query.front().second);
  const bool valid = seconds && *seconds >= 0 && *seconds <= wait_max.count();
  return valid ? std::optional(std::chrono::seconds(*seconds)) : std::nullopt;
}

/// Replies to a submission when the job has ended, or at the deadline.
Answer reply_when_ended(const queue::JobView& view, Time deadline, const std::string& applied,
                        const ApiContext& context, bool timed_out) {
  const std::string id = view.job.id;
  const bool ended = queue::ended(view.job.state);
  if (ended || timed_out) {
    Reply reply = job_reply(ended ? 200 : 202, view, context);
    if (ended) reply.headers.emplace_back("Content-Location", "/v1/jobs/" + id);
    reply.headers.emplace_back("Preference-Applied", applied);
    return reply;
  }
  return defer_until_ended(id, deadline, context, [=, &context](bool late) -> Answer {
    const auto now = find_job(id, context);
    if (!now) return now.error();
    return reply_when_ended(*now, deadline, applied, context, late);
  });
}

Answer get_job_events(Request& request, const ApiContext& context) {
  const std::string& id = request.parameters.front();
  const std::optional<std::int64_t> after = last_event(request);
  // Before the job is read, so that a change in between is not missed.
  std::shared_ptr<Listener> listener = context.events.listen(id, after);
  if (!listener) return too_many_listeners(context);
  const auto view = find_job(id, context);
  if (!view) return view.error();

  const bool ended = queue::ended(view->job.state);
  if (ended && after && context.events.ended_by(id, *after))
    return Reply{.status = 204};  // an EventSource then stops reconnecting
  const bool continues = after && !listener->missed();
  std::string beginning;
  if (ended && continues) {
    const queue::Events::Batch rest = listener->take(SIZE_MAX);
    if (rest.over) beginning = rest.text;
  }
  if (beginning.empty() && (ended || !continues)) {
    const std::int64_t number = ended ? context.events.latest() : listener->start();
    beginning = event_text(current_state(*view, number, context.clock()));
  }
  Reply reply = stream_reply(listener, std::move(beginning));
  if (ended) reply.stream.reset();  // no further events
  reply.job_id = id;
  return reply;
}

Answer get_events(Request& request, const ApiContext& context) {
  const Pairs& query = request.head.query;
  const std::string batch = query.empty() ? "" : query.front().second;
  if (!query.empty()) {
    if (const auto state = find_batch(batch, context); !state) return state.error();
  }
  std::shared_ptr<Listener> listener = context.events.listen(batch, last_event(request));
  if (!listener) return too_many_listeners(context);
  std::string beginning;
  if (listener->missed()) beginning = "id: " + std::to_string(listener->start()) + "\nevent: reset\ndata: {}\n\n";
  return stream_reply(listener, std::move(beginning));
}

Answer get_job(Request& request, const ApiContext& context) {
  const auto wait = read_wait(request.head.query);
  if (!wait) {
    const std::string limit = std::to_string(wait_max.count());
    return Problem{failures::invalid_query, "wait must be given once, as whole seconds 0.." + limit};
  }
  JobPoll poll{request.parameters.front(), std::optional<std::string>(request.head.header("if-none-match")),
               std::chrono::steady_clock::now() + *wait, nullptr};
  if (wait->count() > 0) {
    // Before the job is read, so that no change is missed.
    poll.listener = context.events.listen(poll.id, {});
    if (!poll.listener) return too_many_listeners(context);
  }
  return answer_poll(poll, false, context);
}

}  // namespace

Answer submission_reply(const Request& request, const queue::Submitted& submitted, const ApiContext& context) {
  if (submitted.replayed) return replayed_reply(*submitted.replayed);
  if (submitted.from_cache) {
    Reply reply = job_reply(200, submitted.view, context);
    reply.headers.emplace_back("X-Cache", "hit");
    return reply;
  }
  std::string preferences;
  for (const auto& [name, value] : request.head.headers) {
    if (name == "prefer") preferences += (preferences.empty() ? "" : ",") + value;
  }
  const auto preferred = preferred_wait(preferences);
  if (!preferred || preferred->count() == 0) return job_reply(202, submitted.view, context);
  const std::chrono::seconds wait = std::min(*preferred, wait_max);
  const std::string applied = "wait=" + std::to_string(wait.count());
  const Time deadline = std::chrono::steady_clock::now() + wait;
  return reply_when_ended(submitted.view, deadline, applied, context, false);
}

Endpoints event_endpoints() {
  return {{"GET", "/v1/jobs/{id}", get_job, {.query = {"wait"}}},
          {"GET", "/v1/jobs/{id}/events", get_job_events},
          {"GET", "/v1/events", get_events, {.query = {"batch"}}}};
}

}  // namespace http::handlers
