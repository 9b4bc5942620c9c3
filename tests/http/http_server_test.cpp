/// The gate with handlers made for the test: full queues, parked requests, failing handlers and sources, drain.

#include "tests/http/gate_fixture.h"

namespace gate_test {
namespace {

TEST_F(GateTest, AnswersOverloadedAtOnceWhenTheQueueIsFullAndTheOthersLater) {
  Door door;
  settings.handler_threads = 1;
  settings.waiting_max = 2;
  serve({{"/slow", [&](Request&) -> Answer {
            door.wait();
            return text("slow");
          }}});
  Client running = client(), first = client(), second = client(), third = client();
  running.send_get("/slow");
  ASSERT_TRUE(door.wait_for_arrivals(1));
  first.send_get("/");
  second.send_get("/");
  ASSERT_TRUE(eventually([&] { return request_count == 3; }));  // both wait in the queue
  third.send_get("/");
  const auto refused = third.read_reply();
  EXPECT_EQ(refused.status, 503);
  EXPECT_NE(refused.body.find("urn:whittle:problem:overloaded"), std::string::npos) << refused.body;
  door.open();
  EXPECT_EQ(running.read_reply().body, "slow");
  EXPECT_EQ(first.read_reply().body, "root");
  EXPECT_EQ(second.read_reply().body, "root");
  third.send_get("/");
  EXPECT_EQ(third.read_reply().body, "root") << "the connection of the refused one goes on";
}

TEST_F(GateTest, TellsNothingOfWhatAHandlerThrew) {
  serve({{"/throws", [](Request&) -> Answer { throw std::runtime_error("secret"); }},
         {"/store", [](Request&) -> Answer { throw queue::StoreFailure(queue::StoreFailure::Kind::full, "secret"); }},
         {"/strange", [](Request&) -> Answer { throw 5; }}});
  Client asking = client();
  for (const auto& [path, status] : {std::pair("/throws", 500), std::pair("/store", 503), std::pair("/strange", 500)}) {
    asking.send_get(path);
    const auto got = asking.read_reply();
    EXPECT_EQ(got.status, status);
    EXPECT_EQ(got.body.find("secret"), std::string::npos) << got.body;
  }
}

TEST_F(GateTest, CutsAReplyShortWhenItsSourceFails) {
  serve({{"/broken", [](Request&) -> Answer {
            Reply reply = text("");
            reply.source = http::BodySource{1'000'000, [](std::uint64_t offset, char* into, std::size_t size) {
                                              if (offset > 0) throw std::runtime_error("disk");
                                              std::fill_n(into, std::min<std::size_t>(size, 1000), 'a');
                                              return std::min<std::size_t>(size, 1000);
                                            }};
            return reply;
          }}});
  Client asking = client();
  asking.send_get("/broken");
  EXPECT_EQ(asking.read_reply().body, std::string(1000, 'a'));
  EXPECT_EQ(asking.read(1), "") << "the connection ends";
}

/// A handler that parks until `wake` is called; tells what happens to the watch.
struct Parking {
  std::mutex mutex;
  std::function<void()> wake;
  std::atomic<int> watched = 0, stopped = 0;
  std::chrono::milliseconds patience_of_request{600'000};
  bool wake_at_once = false;

  Answer park(std::function<Answer(bool timed_out)> resume) {
    http::DeferredReply parked;
    parked.deadline = std::chrono::steady_clock::now() + patience_of_request;
    parked.watch = [this](std::function<void()> wake_up) -> std::function<void()> {
      const std::lock_guard lock(mutex);
      wake = std::move(wake_up);
      if (wake_at_once) wake();
      ++watched;
      return [this] { ++stopped; };
    };
    parked.resume = std::move(resume);
    return parked;
  }
  http::Handler handler() {
    return [this](Request&) { return park([](bool timed_out) { return text(timed_out ? "timed out" : "woken"); }); };
  }
  void wake_up() {
    const std::lock_guard lock(mutex);
    wake();
  }
};

TEST_F(GateTest, ParkedRequestIsAnsweredWhenItIsWoken) {
  Parking parking;
  settings.handler_threads = 1;
  serve({{"/wait", parking.handler()}});
  Client waiting = client(), other = client();
  waiting.send_get("/wait");
  ASSERT_TRUE(eventually([&] { return parking.watched == 1; }));
  other.send_get("/");
  EXPECT_EQ(other.read_reply().body, "root") << "the only thread is free";
  parking.wake_up();
  EXPECT_EQ(waiting.read_reply().body, "woken");
  parking.wake_up();  // nobody waits any more
  waiting.send_get("/");
  EXPECT_EQ(waiting.read_reply().body, "root");
  EXPECT_EQ(parking.stopped, 0) << "a watch that has called is over";
}

TEST_F(GateTest, WakeBeforeTheRequestIsParkedIsNotLost) {
  Parking parking;
  parking.wake_at_once = true;
  serve({{"/wait", parking.handler()}});
  Client waiting = client();
  for (int i = 0; i < 200; ++i) {
    waiting.send_get("/wait");
    ASSERT_EQ(waiting.read_reply().body, "woken");
  }
}

TEST_F(GateTest, ParkedRequestIsAnsweredAtItsDeadlineAndTheWatchStopped) {
  Parking parking;
  parking.patience_of_request = 0ms;
  serve({{"/wait", parking.handler()}});
  Client waiting = client();
  waiting.send_get("/wait");
  EXPECT_EQ(waiting.read_reply().body, "timed out");
  EXPECT_EQ(parking.stopped, 1);
}

TEST_F(GateTest, ParkedRequestMayParkAgain) {
  Parking parking;
  std::atomic<int> rounds = 0;
  const std::function<Answer(bool)> again = [&](bool) -> Answer {
    if (++rounds == 3) return text("third");
    return parking.park(again);
  };
  serve({{"/wait", [&](Request&) { return parking.park(again); }}});
  Client waiting = client();
  waiting.send_get("/wait");
  for (int round = 1; round <= 3; ++round) {
    ASSERT_TRUE(eventually([&] { return parking.watched == round; }));
    parking.wake_up();
  }
  EXPECT_EQ(waiting.read_reply().body, "third");
}

TEST_F(GateTest, WatchOfAClientThatLeavesIsStopped) {
  Parking parking;
  serve({{"/wait", parking.handler()}});
  {
    Client leaving = client();
    leaving.send_get("/wait");
    ASSERT_TRUE(eventually([&] { return parking.watched == 1; }));
  }
  EXPECT_TRUE(eventually([&] { return parking.stopped == 1; }));
  parking.wake_up();  // too late, and harmless
}

TEST_F(GateTest, WakeAfterTheGateIsGoneIsHarmless) {
  Parking parking;
  serve({{"/wait", parking.handler()}});
  Client waiting = client();
  waiting.send_get("/wait");
  ASSERT_TRUE(eventually([&] { return parking.watched == 1; }));
  gate.reset();
  EXPECT_EQ(parking.stopped, 1);
  parking.wake_up();
}

TEST_F(GateTest, WatchThatCannotBeginIsAProblem) {
  serve({{"/wait", [](Request&) -> Answer {
            return http::DeferredReply{std::chrono::steady_clock::now() + patience,
                                       [](const std::function<void()>&) -> std::function<void()> {
                                         throw queue::StoreFailure(queue::StoreFailure::Kind::unavailable, "gone");
                                       },
                                       [](bool) -> Answer { return text("never"); }};
          }}});
  Client waiting = client();
  waiting.send_get("/wait");
  EXPECT_EQ(waiting.read_reply().status, 503);
}

TEST_F(GateTest, DrainAnswersWhatHasBegunAndTakesNobodyElse) {
  Door door;
  Parking parking;
  serve({{"/slow",
          [&](Request&) -> Answer {
            door.wait();
            return text("slow");
          }},
         {"/wait", parking.handler()}});
  Client idle = client(), running = client(), waiting = client();
  idle.send_get("/");
  EXPECT_EQ(idle.read_reply().body, "root");
  running.send_get("/slow");
  waiting.send_get("/wait");
  ASSERT_TRUE(door.wait_for_arrivals(1));
  ASSERT_TRUE(eventually([&] { return parking.watched == 1; }));

  std::atomic<bool> drained = false;
  std::thread draining([&] {
    gate->drain(patience);
    drained = true;
  });
  EXPECT_EQ(idle.read(1), "") << "idle connections are closed";
  EXPECT_EQ(waiting.read_reply().body, "timed out");
  EXPECT_FALSE(client().connected());
  EXPECT_FALSE(drained) << "one request is still running";
  door.open();
  EXPECT_EQ(running.read_reply().body, "slow");
  EXPECT_EQ(running.read(1), "");
  draining.join();
}

TEST_F(GateTest, DrainGivesUpOnARequestThatNeverEnds) {
  Door door;
  serve({{"/slow", [&](Request&) -> Answer {
            door.wait();
            return text("slow");
          }}});
  Client running = client();
  running.send_get("/slow");
  ASSERT_TRUE(door.wait_for_arrivals(1));
  gate->drain(0ms);
  door.open();
  gate.reset();
}

}  // namespace
}  // namespace gate_test
