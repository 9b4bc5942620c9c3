/// Streams of server-sent events of one job or of all jobs. Streaming occupies no thread.

#include <cstdint>

#include "server/http/handlers/handlers.h"
#include "server/http/header_text.h"
#include "server/resources/resource_json.h"

namespace http {

std::string event_text(const queue::JobEvent& event) {
  using Kind = queue::JobEvent::Kind;
  const char* const name = event.kind == Kind::done ? "done" : (event.kind == Kind::progress ? "progress" : "state");
  // The data ends with a newline.
  return "id: " + std::to_string(event.number) + "\nevent: " + name + "\ndata: " + resources::write_event(event) + '\n';
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
  Reply reply;
  reply.content_type = "text/event-stream";
  reply.headers.emplace_back("Cache-Control", "no-store");
  reply.headers.emplace_back("X-Accel-Buffering", "no");  // otherwise nginx delays events until it has many
  reply.body = "retry: 2000\n\n" + std::move(beginning);
  reply.stream = std::make_shared<BodyStream>();
  reply.stream->heartbeat = ": heartbeat\n\n";
  reply.stream->take = [listener]() -> BodyStream::Chunk {
    auto [text, over] = listener->take(chunk_bytes);
    return {std::move(text), over};
  };
  reply.stream->watch = [listener](std::function<void()> notify) { listener->on_news(std::move(notify)); };
  return reply;
}

/// The state of a job as an event.
queue::JobEvent current_state(const queue::JobView& view, std::int64_t number, std::int64_t now) {
  using Kind = queue::JobEvent::Kind;
  const Kind kind = queue::ended(view.job.state) ? Kind::done : Kind::state;
  return {number, kind, view.job.id, queue::name_of(view.job.state), view.progress, now};
}

}  // namespace

Answer get_job_events(Request& request, const ApiContext& context) {
  const std::string& id = request.parameters.front();
  const std::optional<std::int64_t> after = last_event(request);
  // Before the job is read, so that a change in between is not missed.
  std::shared_ptr<Listener> listener = context.events.listen(id, after);
  if (!listener) return too_many_listeners(context);
  const auto view = find_job(id, context);
  if (!view) return view.error();

  const bool ended = queue::ended(view->job.state);
  if (ended && after && context.events.ended_by(id, *after)) {
    Reply reply;
    reply.status = 204;  // an EventSource then stops reconnecting
    return reply;
  }
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
  std::shared_ptr<Listener> listener = context.events.listen({}, last_event(request));
  if (!listener) return too_many_listeners(context);
  std::string beginning;
  if (listener->missed()) beginning = "id: " + std::to_string(listener->start()) + "\nevent: reset\ndata: {}\n\n";
  return stream_reply(listener, std::move(beginning));
}

}  // namespace http::handlers
