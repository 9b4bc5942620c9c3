/// The HTTP server with handlers of the test: full queues, deferred replies, failing handlers and sources, drain.

#include <httplib.h>

#include <deque>

#include "server/queue/job_store.h"
#include "tests/http/http_server_fixture.h"

namespace http_server_test {
namespace {

TEST_F(HttpServerTest, AnswersOverloadedAtOnceIfTheHandlerQueueIsFull) {
  settings.handler_threads = 1;
  settings.waiting_max = 2;
  serve({{"/slow", slow()}});
  Client running = client(), first = client(), second = client(), third = client();
  running.send_get("/slow");
  ASSERT_TRUE(barrier.wait_for_waiters(1));
  first.send_get("/");
  second.send_get("/");
  ASSERT_TRUE(eventually([&] { return request_count == 3; }));  // both are queued
  const auto refused = third.get("/");
  EXPECT_EQ(refused.status, 503);
  EXPECT_NE(refused.body.find("urn:whittle:problem:overloaded"), std::string::npos) << refused.body;
  barrier.open();
  EXPECT_EQ(running.read_reply().body, "slow");
  EXPECT_EQ(first.read_reply().body, "root");
  EXPECT_EQ(second.read_reply().body, "root");
  EXPECT_EQ(third.get("/").body, "root") << "the connection of the refused request stays open";
}

TEST_F(HttpServerTest, HandlesSlowRoutesOneAtATime) {
  std::atomic<int> running = 0, running_max = 0;
  const auto counted = [&](Request& request) -> Answer {
    running_max = std::max(running_max.load(), ++running);
    const Answer answer = slow()(request);
    --running;
    return answer;
  };
  slow_paths = {"/a", "/b/{id}"};
  serve({{"/a", counted}, {"/b/{id}", counted}});
  std::deque<Client> clients;
  for (const char* path : {"/a", "/b/1", "/%61", "/b/%32"}) clients.emplace_back(server->port()).send_get(path);
  ASSERT_TRUE(eventually([&] { return request_count == 4; }));
  ASSERT_TRUE(barrier.wait_for_waiters(1));
  Client other = client();
  for (int i = 0; i < 100; ++i) {
    EXPECT_EQ(other.get("/").body, "root");
  }
  EXPECT_EQ(running_max, 1);
  barrier.open();
  for (Client& each : clients) EXPECT_EQ(each.read_reply().body, "slow");
  EXPECT_EQ(running_max, 1);
}

TEST_F(HttpServerTest, SlowRoutesTakeHalfOfTheQueue) {
  settings.handler_threads = 2;
  settings.waiting_max = 4;
  slow_paths = {"/slow"};
  serve({{"/slow", slow()}});
  Client running = client(), first = client(), second = client(), third = client(), other = client();
  running.send_get("/slow");
  ASSERT_TRUE(barrier.wait_for_waiters(1));
  first.send_get("/slow");
  second.send_get("/slow");
  ASSERT_TRUE(eventually([&] { return request_count == 3; }));
  EXPECT_EQ(third.get("/slow").status, 503);
  EXPECT_EQ(other.get("/").body, "root");
  barrier.open();
  for (Client* each : {&running, &first, &second}) EXPECT_EQ(each->read_reply().body, "slow");
}

/// cpp-httplib, which shares no code and no author with the server.
TEST_F(HttpServerTest, AnswersAnIndependentClient) {
  serve({});
  httplib::Client client("127.0.0.1", server->port());
  client.set_read_timeout(patience);
  client.set_keep_alive(true);
  const auto body = [](const httplib::Result& reply) { return reply ? reply->body : to_string(reply.error()); };
  for (int i = 0; i < 100; ++i) ASSERT_EQ(body(client.Get("/")), "root");
  const httplib::Result head = client.Head("/");
  ASSERT_EQ(body(head), "");
  EXPECT_EQ(head->get_header_value("Content-Length"), "4");
  EXPECT_EQ(body(client.Get("/")), "root") << "the next reply begins where the headers ended";
  for (const std::size_t size : {std::size_t{0}, std::size_t{1}, std::size_t{65'536}, std::size_t{5} << 20})
    EXPECT_EQ(body(client.Post("/size", std::string(size, 'x'), "text/plain")), std::to_string(size));
  EXPECT_EQ(server->connections(), 1u);
  const httplib::Result refused = client.Post("/", "text", "text/plain");
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->status, 405);
  EXPECT_EQ(refused->get_header_value("Content-Type"), "application/problem+json");
}

TEST_F(HttpServerTest, HidesTheTextOfHandlerExceptions) {
  serve({{"/throws", [](Request&) -> Answer { throw std::runtime_error("secret"); }},
         {"/store", [](Request&) -> Answer { throw queue::StoreFailure(queue::StoreFailure::Kind::full, "secret"); }},
         {"/other", [](Request&) -> Answer { throw 5; }}});
  Client connection = client();
  for (const auto& [path, status] : {std::pair("/throws", 500), std::pair("/store", 503), std::pair("/other", 500)}) {
    const auto response = connection.get(path);
    EXPECT_EQ(response.status, status);
    EXPECT_EQ(response.body.find("secret"), std::string::npos) << response.body;
  }
}

TEST_F(HttpServerTest, ReadsBodiesThatWaitForANetworkOnOtherThreads) {
  settings.body_threads = 2;
  std::string bytes(3'500'000, '\0');
  for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<char>(i * 2654435761u >> 13);
  serve({{"/remote", [&](Request&) -> Answer {
            Reply reply = text("");
            reply.source = http::BodySource{bytes.size(), [&](std::uint64_t offset, char* into, std::size_t size) {
                                              if (offset > 2'000'000) barrier.wait();
                                              return bytes.copy(into, size, offset);
                                            }};
            return reply;
          }}});
  Client connection = client(), gone = client(), other = client();
  connection.send_get("/remote");
  {
    Client leaves = client();
    leaves.send_get("/remote");
    EXPECT_EQ(leaves.read(1000).size(), 1000u);
  }
  EXPECT_EQ(connection.read(1'500'000).size(), 1'500'000u);
  ASSERT_TRUE(barrier.wait_for_waiters(1));
  for (int i = 0; i < 10; ++i) {
    EXPECT_EQ(other.get("/").body, "root") << "the event loop does not wait";
  }
  barrier.open();
  gone.send_get("/remote");
  for (int i = 0; i < 2; ++i) {
    EXPECT_TRUE(gone.read_reply().body == bytes);
    if (i == 0) gone.send_get("/remote");
  }
}

TEST_F(HttpServerTest, CutsAReplyShortIfItsSourceFails) {
  constexpr std::size_t sent = 1u << 20;
  for (const std::size_t threads : {0u, 1u}) {
    settings.body_threads = threads;
    serve({{"/broken", [](Request&) -> Answer {
              Reply reply = text("");
              reply.source = http::BodySource{2 * sent, [](std::uint64_t offset, char* into, std::size_t size) {
                                                if (offset >= sent) throw std::runtime_error("disk or network");
                                                std::fill_n(into, std::min<std::size_t>(size, sent - offset), 'a');
                                                return std::min<std::size_t>(size, sent - offset);
                                              }};
              return reply;
            }}});
    Client connection = client();
    EXPECT_EQ(connection.get("/broken").body, std::string(sent, 'a')) << threads;
    EXPECT_EQ(connection.read(1), "") << "the connection ends";
  }
}

/// A handler that defers its reply until `notify` is called, and counts the started and stopped watches.
struct Deferring {
  std::mutex mutex;
  std::function<void()> notify;
  std::atomic<int> watched = 0, stopped = 0;
  std::chrono::milliseconds reply_timeout{600'000};
  bool notify_at_once = false;

  Answer defer(std::function<Answer(bool timed_out)> resume) {
    http::DeferredReply deferred;
    deferred.deadline = std::chrono::steady_clock::now() + reply_timeout;
    deferred.watch = [this](std::function<void()> notify_server) -> std::function<void()> {
      const std::lock_guard lock(mutex);
      notify = std::move(notify_server);
      if (notify_at_once) notify();
      ++watched;
      return [this] { ++stopped; };
    };
    deferred.resume = std::move(resume);
    return deferred;
  }
  http::Handler handler() {
    return
        [this](Request&) { return defer([](bool timed_out) { return text(timed_out ? "timed out" : "notified"); }); };
  }
  void notify_watch() {
    const std::lock_guard lock(mutex);
    notify();
  }
};

class DeferredReplyTest : public HttpServerTest {
 protected:
  Deferring deferring;
};

TEST_F(DeferredReplyTest, AnswersADeferredReplyAfterItsNotification) {
  settings.handler_threads = 1;
  serve({{"/wait", deferring.handler()}});
  Client waiting = client(), other = client();
  waiting.send_get("/wait");
  ASSERT_TRUE(eventually([&] { return deferring.watched == 1; }));
  EXPECT_EQ(other.get("/").body, "root") << "the only handler thread is free";
  deferring.notify_watch();
  EXPECT_EQ(waiting.read_reply().body, "notified");
  deferring.notify_watch();  // no reply is deferred any more
  EXPECT_EQ(waiting.get("/").body, "root");
  EXPECT_EQ(deferring.stopped, 0) << "a watch that has notified is not stopped";
}

TEST_F(DeferredReplyTest, KeepsANotificationThatComesBeforeTheReplyIsDeferred) {
  deferring.notify_at_once = true;
  serve({{"/wait", deferring.handler()}});
  Client waiting = client();
  for (int i = 0; i < 200; ++i) {
    ASSERT_EQ(waiting.get("/wait").body, "notified");
  }
}

TEST_F(DeferredReplyTest, AnswersADeferredReplyAtItsDeadlineAndStopsTheWatch) {
  deferring.reply_timeout = 0ms;
  serve({{"/wait", deferring.handler()}});
  Client waiting = client();
  EXPECT_EQ(waiting.get("/wait").body, "timed out");
  EXPECT_EQ(deferring.stopped, 1);
}

TEST_F(DeferredReplyTest, DefersAReplyRepeatedly) {
  std::atomic<int> rounds = 0;
  const std::function<Answer(bool)> again = [&](bool) -> Answer {
    if (++rounds == 3) return text("third");
    return deferring.defer(again);
  };
  serve({{"/wait", [&](Request&) { return deferring.defer(again); }}});
  Client waiting = client();
  waiting.send_get("/wait");
  for (int round = 1; round <= 3; ++round) {
    ASSERT_TRUE(eventually([&] { return deferring.watched == round; }));
    deferring.notify_watch();
  }
  EXPECT_EQ(waiting.read_reply().body, "third");
}

TEST_F(DeferredReplyTest, StopsTheWatchOfADisconnectedClient) {
  serve({{"/wait", deferring.handler()}});
  {
    Client leaving = client();
    leaving.send_get("/wait");
    ASSERT_TRUE(eventually([&] { return deferring.watched == 1; }));
  }
  EXPECT_TRUE(eventually([&] { return deferring.stopped == 1; }));
  deferring.notify_watch();  // without effect
}

TEST_F(DeferredReplyTest, IgnoresANotificationAfterTheEndOfTheServer) {
  serve({{"/wait", deferring.handler()}});
  Client waiting = client();
  waiting.send_get("/wait");
  ASSERT_TRUE(eventually([&] { return deferring.watched == 1; }));
  server.reset();
  EXPECT_EQ(deferring.stopped, 1);
  deferring.notify_watch();
}

TEST_F(HttpServerTest, AnswersAProblemIfAWatchCannotStart) {
  serve({{"/wait", [](Request&) -> Answer {
            return http::DeferredReply{std::chrono::steady_clock::now() + patience,
                                       [](const std::function<void()>&) -> std::function<void()> {
                                         throw queue::StoreFailure(queue::StoreFailure::Kind::unavailable, "gone");
                                       },
                                       [](bool) -> Answer { return text("never"); }};
          }}});
  Client waiting = client();
  EXPECT_EQ(waiting.get("/wait").status, 503);
}

TEST_F(DeferredReplyTest, DrainAnswersReceivedRequestsAndRefusesConnections) {
  serve({{"/slow", slow()}, {"/wait", deferring.handler()}});
  Client idle = client(), running = client(), waiting = client();
  EXPECT_EQ(idle.get("/").body, "root");
  running.send_get("/slow");
  waiting.send_get("/wait");
  ASSERT_TRUE(barrier.wait_for_waiters(1));
  ASSERT_TRUE(eventually([&] { return deferring.watched == 1; }));

  std::atomic<bool> drained = false;
  std::thread draining([&] {
    server->drain(patience);
    drained = true;
  });
  EXPECT_EQ(idle.read(1), "") << "idle connections are closed";
  EXPECT_EQ(waiting.read_reply().body, "timed out");
  EXPECT_FALSE(client().connected());
  EXPECT_FALSE(drained) << "one request is still running";
  barrier.open();
  EXPECT_EQ(running.read_reply().body, "slow");
  EXPECT_EQ(running.read(1), "");
  draining.join();
}

TEST_F(HttpServerTest, DrainReturnsAfterItsGracePeriod) {
  serve({{"/slow", slow()}});
  Client running = client();
  running.send_get("/slow");
  ASSERT_TRUE(barrier.wait_for_waiters(1));
  server->drain(0ms);
  barrier.open();
  server.reset();
}

}  // namespace
}  // namespace http_server_test
