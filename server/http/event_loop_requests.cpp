/// What happens to a request between socket and handler: dispatch, waiting, reply.

#include <utility>

#include "server/http/event_loop.h"

namespace http {
namespace {

using Clock = std::chrono::steady_clock;

double milliseconds_since(Time start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

void log_request(const telemetry::Log& log, const PendingRequest& exchange, const Reply& reply) {
  const Request& request = exchange.request;
  std::vector<telemetry::Field> fields{{"request_id", request.id},
                                       {"method", request.head.method},
                                       {"path", request.head.path},
                                       {"status", std::int64_t{reply.status}},
                                       {"duration_ms", milliseconds_since(exchange.started)},
                                       {"remote", request.remote}};
  if (!request.owner.empty()) fields.push_back({"key", request.owner});
  if (!reply.job_id.empty()) fields.push_back({"job_id", reply.job_id});
  if (reply.failure) fields.push_back({"problem", rule_of(*reply.failure).name});
  log.write(level_of(reply.failure, request.head.method), "request", fields);
}

Finished finished(const std::shared_ptr<PendingRequest>& exchange, Reply reply, bool draining,
                  const telemetry::Log& log, const Told& told) {
  const Request& request = exchange->request;
  if (told) told(request.head.method, request.route, reply.status, milliseconds_since(exchange->started) / 1000);
  const bool keep_alive = request.head.keep_alive && !draining && !reply.stream;
  const bool to_head = request.head.method == "HEAD";
  log_request(log, *exchange, reply);
  std::string text = serialized(reply, request.id, keep_alive, to_head);
  if (to_head) return {exchange, std::move(text), std::nullopt, nullptr, keep_alive};
  return {exchange, std::move(text), std::move(reply.source), std::move(reply.stream), keep_alive};
}

/// On a handler's thread: passes on what a handler answered.
void deliver(const std::shared_ptr<PendingRequest>& exchange, Answer answer, const std::shared_ptr<Mailbox>& mailbox,
             bool draining, Router& router, const telemetry::Log& log, const Told& told) {
  std::function<void()> stop_watching;
  if (auto* parked = std::get_if<DeferredReply>(&answer)) {
    exchange->parked = std::move(*parked);
    const auto wake = [mailbox, client = exchange->client, waiting = std::weak_ptr(exchange)] {
      mailbox->post(Wake{client, waiting});
    };
    auto failed = router.start_watch(exchange->parked, wake, stop_watching, exchange->request);
    if (!failed) return mailbox->post(Waiting{exchange, std::move(stop_watching)});
    answer = std::move(*failed);
  }
  mailbox->post(finished(exchange, std::get<Reply>(std::move(answer)), draining, log, told));
}

}  // namespace

void HttpServer::Loop::refuse(Client& client) {
  const Problem problem = *std::exchange(client.connection.refusal, std::nullopt);
  const std::string request_id = new_request_id_();
  const Reply reply = problem_reply(problem, request_id);
  log_.write(level_of(reply.failure, {}), "request",
             {{"request_id", request_id},
              {"status", std::int64_t{reply.status}},
              {"remote", client.connection.remote()},
              {"problem", rule_of(problem.failure).name},
              {"detail", problem.detail}});
  if (settings_.told) settings_.told({}, {}, reply.status, 0);
  client.connection.reply(serialized(reply, request_id, false, false), std::nullopt, false, now_);
}

void HttpServer::Loop::dispatch(Client& client) {
  auto exchange = std::make_shared<PendingRequest>();
  exchange->client = client.number;
  exchange->request = *std::exchange(client.connection.request, std::nullopt);
  exchange->request.id = new_request_id_();
  exchange->started = now_;
  client.exchange = exchange;
  client.woken = false;
  const bool heavy = exchange->request.body.spooled();
  const bool taken = pool_->submit(
      [this, exchange, mailbox = mailbox_](Router& router) {
        deliver(exchange, router.answer(exchange->request), mailbox, draining_, router, log_, settings_.told);
      },
      heavy);
  if (taken) return;
  const Problem problem{
      Failure::overloaded, "more than " + std::to_string(settings_.waiting_max) + " requests wait", {}};
  Finished refused = finished(exchange, problem_reply(problem, exchange->request.id), draining_, log_, settings_.told);
  client.exchange.reset();
  client.connection.reply(std::move(refused.text), std::nullopt, refused.keep_alive, now_);
}

void HttpServer::Loop::resume(Client& client, bool timed_out) {
  if (timed_out) client.stop_watching();
  client.stop_watching = nullptr;
  client.woken = false;
  pool_->resume([this, timed_out, exchange = client.exchange, mailbox = mailbox_](Router& router) {
    // Handing the continuation over first: the answer may be to wait again.
    const DeferredReply parked = std::exchange(exchange->parked, {});
    deliver(exchange, router.resume(parked, timed_out, exchange->request), mailbox, draining_, router, log_,
            settings_.told);
  });
}

void HttpServer::Loop::take_messages() {
  for (Message& message : mailbox_->take()) {
    std::visit([this](auto& content) { receive(content); }, message);
  }
}

void HttpServer::Loop::receive(Finished& finished) {
  with_client(finished.exchange->client, [&](Client& client) {
    if (finished.stream) {
      start_stream(client, finished);
    } else {
      client.exchange.reset();
      client.connection.reply(std::move(finished.text), std::move(finished.source), finished.keep_alive, now_);
    }
    update_variances(client);
  });
}

void HttpServer::Loop::start_stream(Client& client, Finished& finished) {
  client.connection.start_stream(std::move(finished.text), now_);
  client.stream = std::move(finished.stream);
  client.sign_of_life_due = now_ + client.stream->quiet;
  client.exchange->request = {};  // a stream may last for days
  client.stream->watch([mailbox = mailbox_, number = client.number, exchange = std::weak_ptr(client.exchange)] {
    mailbox->post(Wake{number, exchange});
  });
  feed_stream(client);
  if (draining_) end_stream(client);
}

/// What the socket has not taken is not added to: a slow reader keeps one piece here, the rest is the source's.
void HttpServer::Loop::feed_stream(Client& client) {
  Connection& connection = client.connection;
  while (client.stream && connection.state() == Connection::State::streaming && !connection.wants_to_write()) {
    BodyStream::Piece piece = client.stream->take();
    if (piece.text.empty() && !piece.over) return;
    client.sign_of_life_due = now_ + client.stream->quiet;
    if (!piece.text.empty()) connection.append(std::move(piece.text), now_);
    if (piece.over) end_stream(client);
  }
}

void HttpServer::Loop::end_stream(Client& client) {
  client.stream.reset();
  if (client.connection.state() == Connection::State::streaming) client.connection.end_stream(now_);
}

void HttpServer::Loop::receive(Waiting& waiting) {
  if (find(waiting.exchange->client) == nullptr) return waiting.stop_watching();  // left meanwhile
  with_client(waiting.exchange->client, [&](Client& client) {
    client.stop_watching = std::move(waiting.stop_watching);
    if (client.woken) {
      resume(client, false);
    } else if (draining_) {
      resume(client, true);
    }
    update_variances(client);
  });
}

void HttpServer::Loop::receive(Wake& wake) {
  const auto exchange = wake.exchange.lock();
  with_client(wake.client, [&](Client& client) {
    if (exchange == nullptr || client.exchange != exchange) return;  // answered meanwhile
    client.woken = true;
    if (client.stream) {
      feed_stream(client);
    } else if (client.stop_watching) {
      resume(client, false);
    } else {
      return;
    }
    update_variances(client);
  });
}

void HttpServer::Loop::receive(Drain&) {
  listener_.close();
  std::vector<std::uint64_t> numbers;
  numbers.reserve(clients_.size());
  for (const auto& [number, client] : clients_) numbers.push_back(number);
  for (const std::uint64_t number : numbers) {
    with_client(number, [this](Client& client) {
      if (client.stop_watching) resume(client, true);
      if (client.stream) end_stream(client);
      update_variances(client);
    });
  }
}

}  // namespace http
