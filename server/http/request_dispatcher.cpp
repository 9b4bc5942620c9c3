#include "server/http/request_dispatcher.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "server/http/header_text.h"
#include "server/queue/job_store.h"

namespace http {
namespace {

/// The X-Request-Id of the client, with which its own log names the request; nothing if it is absent or no plain word.
std::optional<std::string> id_of(const RequestHead& head) {
  constexpr std::string_view plain = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789._:/+=-";
  const auto id = head.header("x-request-id");
  if (!id || id->empty() || id->size() > 128 || id->find_first_not_of(plain) != std::string_view::npos) return {};
  return std::string(*id);
}

using support::ThreadPool;
using telemetry::Level;

double milliseconds_since(Time start) {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

void log_request(const telemetry::Log& log, const PendingRequest& pending, const Reply& reply, double duration_ms) {
  const Request& request = pending.request;
  std::vector<telemetry::Field> fields{{"request_id", request.id},   {"method", request.head.method},
                                       {"path", request.head.path},  {"status", std::int64_t{reply.status}},
                                       {"duration_ms", duration_ms}, {"remote", request.remote}};
  if (request.key) fields.push_back({"key", request.key->name});
  if (!reply.job_id.empty()) fields.push_back({"job_id", reply.job_id});
  if (reply.failure) fields.push_back({"problem", reply.failure->name});
  log.write(level_of(reply.failure, request.head.method), "request", fields);
}

/// The exact cause is in the log; the client receives what it can rely on.
Problem problem_of(const queue::StoreFailure& failure) {
  using Kind = queue::StoreFailure::Kind;
  if (failure.kind == Kind::full) return {failures::disk_full, "the disk is full; nothing was stored"};
  if (failure.kind == Kind::unavailable) {
    return {failures::store_unavailable, "the store is not available; nothing was stored"};
  }
  if (failure.kind == Kind::damaged)
    return {failures::image_damaged, "the bytes have changed since they were stored; retry the job to render it again"};
  if (failure.kind == Kind::unknown) {
    return {failures::store_unavailable,
            "the connection to the database was lost; it is unknown whether this was stored: repeat the request, with "
            "the same Idempotency-Key if there was one"};
  }
  return {failures::store_unavailable,
          "the disk failed; it is unknown until the next start whether this was stored: repeat the request then, with "
          "the same Idempotency-Key if there was one"};
}

/// Unknown and repeated query parameters are refused, like fields of a document, because a typo must not be ignored.
std::optional<Problem> check_query(const Pairs& query, const Route& route) {
  std::string unknown, known;
  for (const auto& [name, value] : query) {
    const bool is_known = std::ranges::find(route.rules.query, name) != route.rules.query.end();
    if (!is_known) unknown += (unknown.empty() ? "\"" : ", \"") + name + '"';
  }
  const std::string repeated(repeated_name(query));
  if (unknown.empty() && repeated.empty()) return std::nullopt;
  if (unknown.empty()) return Problem{failures::invalid_query, repeated + " is given twice"};
  for (const std::string& name : route.rules.query) known += (known.empty() ? "" : ", ") + name;
  return Problem{failures::invalid_query, "unknown: " + unknown + "; known: " + (known.empty() ? "none" : known)};
}

/// Finds the first route of the path and the method, or else the methods that the path has.
void find_route(const std::vector<Route>& routes, PendingRequest& pending) {
  Request& request = pending.request;
  const std::string path = percent_decoded(request.head.path).value_or(request.head.path);
  const std::string_view method = request.head.method == "HEAD" ? "GET" : std::string_view(request.head.method);
  for (const Route& candidate : routes) {
    auto parameters = match(candidate.pattern, path);
    if (!parameters) continue;
    request.route = candidate.pattern;
    if (candidate.method == method) {
      request.parameters = *std::move(parameters);
      pending.route = &candidate;
      return;
    }
    pending.allowed.insert(candidate.method);
    if (candidate.method == "GET") pending.allowed.insert("HEAD");
  }
}

/// Calls the handler of the route. Without one: 404, or 405 with Allow if the path has other methods. Throws only what
/// the handler throws.
Answer handle(PendingRequest& pending) {
  Request& request = pending.request;
  if (pending.route != nullptr) {
    if (auto problem = check_query(request.head.query, *pending.route)) return *std::move(problem);
    if (auto problem = scope_problem(request.key, *pending.route)) return *std::move(problem);
    return pending.route->handler(request);
  }
  if (pending.allowed.empty()) return Problem{failures::not_found, "there is nothing at " + request.head.path};
  std::string list;
  for (const std::string& name : pending.allowed) list += (list.empty() ? "" : ", ") + name;
  const std::string detail = request.head.method + " is not allowed here; allowed: " + list;
  Reply reply = problem_reply({failures::method_not_allowed, detail}, request.id);
  reply.headers.emplace_back("Allow", list);
  return reply;
}

/// Leaves out a body that the client has already (RFC 9110, section 13.1.2).
void apply_precondition(const RequestHead& head, Reply& reply) {
  const auto known = head.header("if-none-match");
  if (!known || reply.status != 200 || (head.method != "GET" && head.method != "HEAD")) return;
  const auto is_known = [&](const auto& header) {
    return header.first == "ETag" && none_match_names(known, header.second);
  };
  if (std::ranges::none_of(reply.headers, is_known)) return;
  reply.status = 304;
  reply.content_type.clear();
  std::erase_if(reply.headers, [](const auto& header) { return header.first == "Content-Encoding"; });
  reply.body.clear();
  reply.source.reset();
}

}  // namespace

RequestDispatcher::RequestDispatcher(const HttpServerSettings& settings, std::vector<Route> routes,
                                     std::function<std::string()> new_request_id, const telemetry::Log& log,
                                     std::shared_ptr<ServerEvents> events)
    : settings_(settings),
      routes_(std::move(routes)),
      new_request_id_(std::move(new_request_id)),
      log_(log),
      events_(std::move(events)),
      pool_(settings.handler_threads, settings.waiting_max),
      bodies_(settings.body_threads) {}

/// Calls a handler: exceptions and problems become replies.
Answer RequestDispatcher::guarded(const Request& request, const std::function<Answer()>& call) const {
  Problem problem{failures::internal, "the log has the cause under this request_id"};
  try {
    Answer answer = call();
    if (!std::holds_alternative<Problem>(answer)) return answer;
    problem = std::get<Problem>(std::move(answer));
  } catch (const queue::StoreFailure& failure) {
    problem = problem_of(failure);
    log_.write(Level::error, "store_failure",
               {{"request_id", request.id}, {"detail", std::string_view(failure.what())}});
  } catch (const std::exception& exception) {
    log_.write(Level::error, "handler_failure",
               {{"request_id", request.id}, {"detail", std::string_view(exception.what())}});
  } catch (...) {
    log_.write(Level::error, "handler_failure", {{"request_id", request.id}});
  }
  return problem_reply(problem, request.id);
}

/// On a handler thread: starts the watch of a deferred reply, or completes the reply.
void RequestDispatcher::post_answer(const std::shared_ptr<PendingRequest>& pending, Answer answer) {
  if (auto* deferred = std::get_if<DeferredReply>(&answer)) {
    pending->deferred = std::move(*deferred);
    std::function<void()> stop_watching;
    answer = guarded(pending->request, [&]() -> Answer {
      stop_watching = pending->deferred.watch(notifier(pending));
      return DeferredReply{};
    });
    if (std::holds_alternative<DeferredReply>(answer))
      return events_->post(ReplyDeferred{pending, std::move(stop_watching)});
  }
  events_->post(ready(pending, std::get<Reply>(std::move(answer))));
}

ReplyReady RequestDispatcher::ready(const std::shared_ptr<PendingRequest>& pending, Reply reply) const {
  const Request& request = pending->request;
  apply_precondition(request.head, reply);
  const double duration_ms = milliseconds_since(pending->started);
  if (settings_.on_response) {
    settings_.on_response(request.head.method, request.route, reply.status, duration_ms / 1000);
  }
  log_request(log_, *pending, reply, duration_ms);
  const bool keep_alive = request.head.keep_alive && !draining_ && !reply.stream;
  const bool to_head = request.head.method == "HEAD";
  std::string text = serialized(reply, request.id, keep_alive, to_head);
  if (to_head) reply = {};  // before the answer is sent, so that its stream takes no place of the next request
  return {pending, std::move(text), std::move(reply.source), std::move(reply.stream), keep_alive};
}

std::function<void()> RequestDispatcher::notifier(const std::shared_ptr<PendingRequest>& pending) const {
  return [events = events_, client = pending->client, weak = std::weak_ptr(pending)] {
    events->post(Notification{client, weak});
  };
}

void RequestDispatcher::dispatch(Client& client, Time now) {
  auto pending = std::make_shared<PendingRequest>();
  pending->client = client.number;
  pending->request = *std::exchange(client.connection.request, std::nullopt);
  pending->request.id = id_of(pending->request.head).value_or(new_request_id_());
  pending->started = now;
  client.pending = pending;
  client.notified = false;
  const bool spooled = pending->request.body.spooled();
  find_route(routes_, *pending);
  const auto lane = pending->route != nullptr && pending->route->rules.one_at_a_time ? ThreadPool::one_at_a_time
                    : spooled                                                        ? ThreadPool::slow
                                                                                     : ThreadPool::ordinary;
  const bool accepted = pool_.submit(
      [this, pending] { post_answer(pending, guarded(pending->request, [&] { return handle(*pending); })); }, lane);
  if (accepted) return;
  const Problem problem{failures::overloaded,
                        "too many requests wait for a handler, at most " + std::to_string(settings_.waiting_max)};
  ReplyReady refused = ready(pending, problem_reply(problem, pending->request.id));
  start_reply(client, refused, now);
}

void RequestDispatcher::refuse(Client& client, Time now) {
  const Problem problem = *std::exchange(client.connection.refusal, std::nullopt);
  const std::string request_id = new_request_id_();
  const Reply reply = problem_reply(problem, request_id);
  log_.write(level_of(reply.failure, {}), "request",
             {{"request_id", request_id},
              {"status", std::int64_t{reply.status}},
              {"remote", client.connection.remote()},
              {"problem", problem.failure.name},
              {"detail", problem.detail}});
  if (settings_.on_response) settings_.on_response({}, {}, reply.status, 0);
  client.connection.reply(serialized(reply, request_id, false, false), std::nullopt, false, now);
}

void RequestDispatcher::resume(Client& client, bool timed_out) {
  if (timed_out) client.stop_watching();
  client.stop_watching = nullptr;
  client.notified = false;
  const auto answer = [this, timed_out, pending = client.pending] {
    const DeferredReply deferred = std::exchange(pending->deferred, {});  // the answer may be deferred again
    post_answer(pending, guarded(pending->request, [&] { return deferred.resume(timed_out); }));
  };
  pool_.add(answer, true);
}

void RequestDispatcher::abandon(const std::shared_ptr<PendingRequest>& pending) {
  if (!pending->deferred.on_disconnected) return;
  const auto end = [this, pending] {
    (void)guarded(pending->request, [&]() -> Answer {
      pending->deferred.on_disconnected();
      return Reply{};
    });
  };
  pool_.add(end, true);
}

void RequestDispatcher::refuse_deferred(Client& client, const Problem& problem, Time now) {
  std::exchange(client.stop_watching, nullptr)();
  abandon(client.pending);
  client.notified = false;
  ReplyReady refused = ready(client.pending, problem_reply(problem, client.pending->request.id));
  start_reply(client, refused, now);
}

void RequestDispatcher::on_deferred(Client& client, std::function<void()> stop_watching) {
  client.stop_watching = std::move(stop_watching);
  if (client.notified || draining_) resume(client, !client.notified);
}

void RequestDispatcher::start_reply(Client& client, ReplyReady& ready, Time now) {
  if (!ready.stream) {
    client.pending.reset();
    return client.connection.reply(std::move(ready.text), std::move(ready.source), ready.keep_alive, now);
  }
  client.start_stream(std::move(ready.text), std::move(ready.stream), now);
  client.stream->watch(notifier(client.pending));
  client.feed_stream(now);
  if (draining_) client.end_stream(now);
}

void RequestDispatcher::read_body(Client& client, Time now) {
  auto part = client.connection.take_body_part(now);
  if (!part) return;
  bodies_.add([this, number = client.number, part = *std::move(part)] {
    std::string bytes;
    try {
      bytes.resize(part.size);
      bytes.resize(part.source.read(part.offset, bytes.data(), bytes.size()));
    } catch (const std::exception& failure) {
      log_.write(Level::error, "body_cut_short", {{"detail", std::string_view(failure.what())}});
      bytes.clear();
    }
    events_->post(BodyPartRead{number, std::move(bytes)});
  });
}

bool RequestDispatcher::on_notification(Client& client, const Notification& notification, Time now) {
  const auto pending = notification.pending.lock();
  if (pending == nullptr || client.pending != pending) return false;
  client.notified = true;
  if (client.stream) {
    client.feed_stream(now);
  } else if (client.is_deferred()) {
    resume(client, false);
  }
  return true;
}

}  // namespace http
