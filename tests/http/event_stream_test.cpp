/// Streamed replies.

#include "tests/http/http_server_fixture.h"

namespace http_server_test {
namespace {

/// A stream whose output the test produces, with counts of the calls of the server.
class Source {
 public:
  http::Handler handler() {
    return [this](Request&) -> Answer {
      Reply reply = text("");
      reply.stream = std::make_shared<http::BodyStream>();
      reply.stream->heartbeat_interval = heartbeat_interval;
      reply.stream->heartbeat = "alive\n";
      reply.stream->take = [this, held = std::shared_ptr<void>(nullptr, [this](void*) { ++destroyed; })] {
        const std::lock_guard lock(mutex_);
        ++taken;
        return std::exchange(chunk_, {});
      };
      reply.stream->watch = [this](std::function<void()> notify) {
        const std::lock_guard lock(mutex_);
        notify_ = std::move(notify);
        ++watched;
      };
      return reply;
    };
  }
  void produce(const std::string& text, bool last = false) {
    const std::lock_guard lock(mutex_);
    chunk_.text += text;
    chunk_.last = last;
    notify_();
  }

  std::chrono::milliseconds heartbeat_interval{60'000};
  std::atomic<int> watched = 0, taken = 0, destroyed = 0;

 private:
  std::mutex mutex_;
  http::BodyStream::Chunk chunk_;
  std::function<void()> notify_;
};

class BodyStreamTest : public HttpServerTest {
 protected:
  /// A client of the stream, whose output can be produced from now on.
  std::unique_ptr<Client> listen() {
    serve({{"/stream", source.handler()}});
    auto listener = std::make_unique<Client>(server->port());
    listener->send_get("/stream");
    EXPECT_TRUE(eventually([&] { return source.watched == 1; }));
    return listener;
  }

  Source source;
};

TEST_F(BodyStreamTest, SendsChunksAndClosesAfterTheLast) {
  const auto listener = listen();
  const std::string head = listener->read_head();
  EXPECT_TRUE(head.starts_with("HTTP/1.1 200 OK\r\n")) << head;
  EXPECT_NE(head.find("Connection: close\r\n"), std::string::npos) << head;
  EXPECT_EQ(head.find("Content-Length"), std::string::npos) << head;
  source.produce("first\n");
  EXPECT_EQ(listener->read(6), "first\n");
  source.produce("last\n", true);
  EXPECT_EQ(listener->read(100), "last\n");
  EXPECT_TRUE(eventually([&] { return source.destroyed == 1; }));
}

TEST_F(BodyStreamTest, SendsHeartbeatsWhileThereIsNoOutput) {
  source.heartbeat_interval = 5ms;
  const auto listener = listen();
  listener->read_head();
  EXPECT_EQ(listener->read(18), "alive\nalive\nalive\n");
}

TEST_F(BodyStreamTest, IsDestroyedWhenTheClientDisconnects) {
  listen().reset();
  EXPECT_TRUE(eventually([&] { return source.destroyed == 1; }));
  source.produce("late");  // without effect
}

TEST_F(BodyStreamTest, TakesNoMoreOutputForASlowClientAndDisconnectsIt) {
  settings.times.write_grace = 200ms;
  const auto listener = listen();
  listener->read_head();
  source.produce(std::string(64u << 20, 'x'));  // more than any socket buffers
  ASSERT_TRUE(eventually([&] { return source.taken >= 2 || source.destroyed == 1; }));
  const int taken = source.taken;
  source.produce("more");
  EXPECT_TRUE(eventually([&] { return source.destroyed == 1; })) << "disconnected after the write grace";
  EXPECT_LE(source.taken - taken, 0) << "no output is taken before the previous chunk is sent";
}

TEST_F(BodyStreamTest, EndsOnDrain) {
  const auto listener = listen();
  std::thread draining([&] { server->drain(patience); });
  listener->read_head();
  EXPECT_EQ(listener->read(1), "");
  draining.join();
  EXPECT_EQ(source.destroyed, 1);
}

TEST_F(BodyStreamTest, EndsWithTheServer) {
  const auto listener = listen();
  server.reset();
  EXPECT_EQ(source.destroyed, 1);
  source.produce("late");
}

}  // namespace
}  // namespace http_server_test
