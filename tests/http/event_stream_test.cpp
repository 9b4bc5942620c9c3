/// Replies whose body comes as it happens.

#include "tests/http/gate_fixture.h"

namespace gate_test {
namespace {

/// A stream that the test speaks through, and what the gate did with it.
class Source {
 public:
  http::Handler handler() {
    return [this](Request&) -> Answer {
      Reply reply = text("");
      reply.stream = std::make_shared<http::BodyStream>();
      reply.stream->quiet = quiet;
      reply.stream->sign_of_life = "alive\n";
      reply.stream->take = [this, held = std::shared_ptr<void>(nullptr, [this](void*) { ++left; })] {
        const std::lock_guard lock(mutex_);
        ++taken;
        return std::exchange(piece_, {});
      };
      reply.stream->watch = [this](std::function<void()> wake) {
        const std::lock_guard lock(mutex_);
        wake_ = std::move(wake);
        ++watched;
      };
      return reply;
    };
  }
  void say(const std::string& words, bool over = false) {
    const std::lock_guard lock(mutex_);
    piece_.text += words;
    piece_.over = over;
    wake_();
  }

  std::chrono::milliseconds quiet{60'000};
  std::atomic<int> watched = 0, taken = 0, left = 0;

 private:
  std::mutex mutex_;
  http::BodyStream::Piece piece_;
  std::function<void()> wake_;
};

class GateStreamTest : public GateTest {
 protected:
  /// Reads the head of the stream's reply.
  static std::string head_of(Client& client) {
    std::string head;
    while (!head.ends_with("\r\n\r\n")) {
      const std::string byte = client.read(1);
      if (byte.empty()) break;
      head += byte;
    }
    return head;
  }

  Source source;
};

TEST_F(GateStreamTest, SendsWhatComesAndClosesAfterTheLast) {
  serve({{"/stream", source.handler()}});
  Client listening = client();
  listening.send_get("/stream");
  const std::string head = head_of(listening);
  EXPECT_TRUE(head.starts_with("HTTP/1.1 200 OK\r\n")) << head;
  EXPECT_NE(head.find("Connection: close\r\n"), std::string::npos) << head;
  EXPECT_EQ(head.find("Content-Length"), std::string::npos) << head;
  ASSERT_TRUE(eventually([&] { return source.watched == 1; }));
  source.say("first\n");
  EXPECT_EQ(listening.read(6), "first\n");
  source.say("last\n", true);
  EXPECT_EQ(listening.read(100), "last\n");
  EXPECT_TRUE(eventually([&] { return source.left == 1; }));
}

TEST_F(GateStreamTest, GivesSignsOfLifeWhileNothingComes) {
  source.quiet = 5ms;
  serve({{"/stream", source.handler()}});
  Client listening = client();
  listening.send_get("/stream");
  head_of(listening);
  EXPECT_EQ(listening.read(18), "alive\nalive\nalive\n");
}

TEST_F(GateStreamTest, ForgetsAClientThatLeaves) {
  serve({{"/stream", source.handler()}});
  {
    Client listening = client();
    listening.send_get("/stream");
    ASSERT_TRUE(eventually([&] { return source.watched == 1; }));
  }
  EXPECT_TRUE(eventually([&] { return source.left == 1; }));
  source.say("to nobody");  // too late, and harmless
}

TEST_F(GateStreamTest, TakesNothingMoreForAReaderWhoDoesNotReadAndCutsThemOff) {
  settings.times.write_grace = 200ms;
  serve({{"/stream", source.handler()}});
  Client listening = client();
  listening.send_get("/stream");
  head_of(listening);
  ASSERT_TRUE(eventually([&] { return source.watched == 1; }));
  source.say(std::string(64u << 20, 'x'));  // more than any socket takes
  ASSERT_TRUE(eventually([&] { return source.taken >= 2 || source.left == 1; }));
  const int taken = source.taken;
  source.say("more");
  EXPECT_TRUE(eventually([&] { return source.left == 1; })) << "cut off after the write grace";
  EXPECT_LE(source.taken - taken, 0) << "what has not gone out is not added to";
}

TEST_F(GateStreamTest, EndsStreamsWhenItDrains) {
  serve({{"/stream", source.handler()}});
  Client listening = client();
  listening.send_get("/stream");
  ASSERT_TRUE(eventually([&] { return source.watched == 1; }));
  std::thread draining([&] { gate->drain(patience); });
  head_of(listening);
  EXPECT_EQ(listening.read(1), "");
  draining.join();
  EXPECT_EQ(source.left, 1);
}

TEST_F(GateStreamTest, EndsWithTheGate) {
  serve({{"/stream", source.handler()}});
  Client listening = client();
  listening.send_get("/stream");
  ASSERT_TRUE(eventually([&] { return source.watched == 1; }));
  gate.reset();
  EXPECT_EQ(source.left, 1);
  source.say("to nobody");
}

}  // namespace
}  // namespace gate_test
