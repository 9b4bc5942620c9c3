/// Event streams: what happens to one job, or to all, as it happens. Streaming holds no thread.

#include <charconv>
#include <cstdint>

#include "server/http/handlers/handlers.h"
#include "server/resources/job_json.h"

namespace http {
namespace {

using Listener = queue::Events::Listener;

constexpr std::size_t piece_bytes = 8192;  // what a stream that is not read holds in the gate

/// Last-Event-ID: nothing where there is none, or a number that no event has where it is none of ours.
std::optional<std::int64_t> last_event(const Request& request) {
  const auto header = request.head.header("last-event-id");
  if (!header || header->empty()) return std::nullopt;
  std::int64_t number = 0;
  const auto [end, error] = std::from_chars(header->data(), header->data() + header->size(), number);
  return error == std::errc{} && end == header->data() + header->size() && number >= 0 ? number : -1;
}

Reply stream_reply(const std::shared_ptr<Listener>& listener, std::string beginning) {
  Reply reply;
  reply.content_type = "text/event-stream";
  reply.headers.emplace_back("Cache-Control", "no-store");
  reply.headers.emplace_back("X-Accel-Buffering", "no");  // nginx would keep events back until it has many
  reply.body = "retry: 2000\n\n" + std::move(beginning);
  reply.stream = std::make_shared<BodyStream>();
  reply.stream->heartbeat = ": still here\n\n";
  reply.stream->take = [listener]() -> BodyStream::Chunk {
    auto [text, over] = listener->take(piece_bytes);
    return {std::move(text), over};
  };
  reply.stream->watch = [listener](std::function<void()> wake) { listener->on_news(std::move(wake)); };
  return reply;
}

/// How the job stands, as an event.
queue::JobEvent standing(const queue::JobView& view, std::int64_t number, std::int64_t now) {
  using Kind = queue::JobEvent::Kind;
  const queue::Job& job = view.job;
  const Kind kind = queue::ended(job.state) ? Kind::done : Kind::state;
  return {number, kind, job.id, queue::name_of(job.state), view.progress, now};
}

}  // namespace

std::string event_text(const queue::JobEvent& event) {
  using Kind = queue::JobEvent::Kind;
  const char* const name = event.kind == Kind::done ? "done" : (event.kind == Kind::progress ? "progress" : "state");
  // The data ends with its line.
  return "id: " + std::to_string(event.number) + "\nevent: " + name + "\ndata: " + resources::write_event(event) + '\n';
}

Answer get_job_events(Request& request, const ApiContext& front) {
  const std::optional<std::int64_t> after = last_event(request);
  // Listening begins before the job is looked at: what happens in between is in both, not in neither.
  std::shared_ptr<Listener> listener = front.events.listen(request.parameters.front(), after);
  if (!listener) return problem_reply(too_many_listeners(front), request.id);
  const auto view = find_job(request, front);
  if (!view) return problem_reply(view.error(), request.id);

  const bool ended = queue::ended(view->job.state);
  if (ended && after && front.events.ended_by(view->job.id, *after)) {
    Reply reply;
    reply.status = 204;  // what tells an EventSource not to come back
    return reply;
  }
  const bool goes_on = after && !listener->missed();
  std::string beginning;
  if (ended && goes_on) {
    const queue::Events::Batch rest = listener->take(SIZE_MAX);
    if (rest.over) beginning = rest.text;
  }
  if (beginning.empty() && (ended || !goes_on)) {
    beginning = event_text(standing(*view, ended ? front.events.latest() : listener->start(), front.clock()));
  }
  Reply reply = stream_reply(listener, std::move(beginning));
  if (ended) reply.stream.reset();  // all is said
  reply.job_id = view->job.id;
  return reply;
}

Answer get_events(Request& request, const ApiContext& front) {
  std::shared_ptr<Listener> listener = front.events.listen({}, last_event(request));
  if (!listener) return problem_reply(too_many_listeners(front), request.id);
  std::string beginning;
  if (listener->missed()) beginning = "id: " + std::to_string(listener->start()) + "\nevent: reset\ndata: {}\n\n";
  return stream_reply(listener, std::move(beginning));
}

}  // namespace http
