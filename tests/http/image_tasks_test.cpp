#include <gtest/gtest.h>

#include <vector>

#include "server/http/handlers/image_results.h"

namespace {

using http::Answer;

/// Keeps the tasks until the test ends them.
struct FakeRunner final : queue::JobRunner {
  void notify(bool) noexcept override {}
  void cancel(const std::string&) noexcept override {}
  void request_preview(const std::string&, std::uint32_t) noexcept override {}
  void on_lease_lost(const queue::Lease&) noexcept override {}
  std::string not_ready() override { return {}; }
  void run_image_task(const queue::ImageTask&,
                      const std::function<void(queue::ImageTaskResult)>& end) noexcept override {
    ends.push_back(end);
  }
  std::vector<std::function<void(queue::ImageTaskResult)>> ends;
};

/// A request that waits.
struct Request {
  explicit Request(const Answer& answer) : reply(std::get<http::DeferredReply>(answer)) {}
  http::DeferredReply reply;
  int notified = 0;
  std::function<void()> stop = reply.watch([this] { ++notified; });
};

class ImageTasksTest : public testing::Test {
 protected:
  ImageTasksTest() { attached.attach(&runner); }

  Answer run(const std::string& key = "key") {
    return tasks->run(key, {}, [](const auto& result) -> Answer { return http::Reply{.body = result->bytes}; });
  }
  static std::string body_of(const Answer& answer) { return std::get<http::Reply>(answer).body; }
  static http::Failure failure_of(const Answer& answer) { return std::get<http::Problem>(answer).failure; }

  FakeRunner runner;
  queue::AttachedRunner attached;
  std::shared_ptr<http::handlers::ImageTasks> tasks =
      std::make_shared<http::handlers::ImageTasks>(attached, std::chrono::minutes(1), 4000);
};

TEST_F(ImageTasksTest, KeepsTheResultForTheNextRequest) {
  Request first(run());
  EXPECT_EQ(failure_of(first.reply.resume(true)), http::failures::overloaded);
  first.stop();
  runner.ends.at(0)({{}, "image"});
  EXPECT_EQ(first.notified, 0);
  EXPECT_EQ(body_of(run()), "image");
  EXPECT_EQ(tasks->find("key")->bytes, "image");
}

TEST_F(ImageTasksTest, RunsATaskOnceForAllThatWait) {
  Request first(run()), other(run("other"));
  first.stop();
  Request second(run()), third(run());
  ASSERT_EQ(runner.ends.size(), 2u);
  runner.ends[0]({{}, "image"});
  EXPECT_EQ((std::vector{first.notified, second.notified, third.notified, other.notified}), (std::vector{0, 1, 1, 0}));
  for (const Request* const request : {&second, &third}) EXPECT_EQ(body_of(request->reply.resume(false)), "image");
}

TEST_F(ImageTasksTest, NotifiesARequestThatBeginsToWaitAfterTheEnd) {
  const Answer answer = run();
  runner.ends.at(0)({{}, "image"});
  EXPECT_EQ(Request(answer).notified, 1);
}

TEST_F(ImageTasksTest, RepeatsATaskThatMaySucceedLater) {
  const Request first(run());
  runner.ends.at(0)({"the worker has ended", {}});
  EXPECT_EQ(failure_of(first.reply.resume(false)), http::failures::image_not_processed);
  const Request second(run());
  EXPECT_EQ(runner.ends.size(), 2u);
}

TEST_F(ImageTasksTest, KeepsAProblemOfTheImages) {
  const Request first(run());
  runner.ends.at(0)({"no image", {}, {}, "bad_image"});
  EXPECT_EQ(failure_of(run()), http::failures::bad_image);
  EXPECT_EQ(tasks->find("key"), nullptr);
}

TEST_F(ImageTasksTest, KeepsNoMoreBytesThanItsLimit) {
  for (const char* const key : {"a", "b", "c", "d", "e"}) {
    const Request request(run(key));
    runner.ends.back()({{}, std::string(1000, 'x')});
  }
  EXPECT_EQ(tasks->find("a"), nullptr);
  EXPECT_NE(tasks->find("e"), nullptr);
}

}  // namespace
