/// What a worker says beside its messages comes into the daemon's log: line by line, cut, counted.

#include "server/worker/supervisor/output_reader.h"

#include <fcntl.h>
#include <unistd.h>

#include <array>

#include "tests/queue/supervised.h"

using queue::JobState;
using worker::OutputReader;

namespace {

/// A pipe and what was heard of it.
class Heard {
 public:
  Heard() {
    std::array<int, 2> ends{};
    EXPECT_EQ(pipe2(ends.data(), O_CLOEXEC | O_NONBLOCK), 0);
    output = OutputReader(worker::Descriptor(ends[0]));
    mouth = worker::Descriptor(ends[1]);
  }
  void say(const std::string& text) const {
    ASSERT_EQ(::write(mouth.get(), text.data(), text.size()), static_cast<ssize_t>(text.size()));
  }
  void listen(OutputReader::Time now = {}) {
    output.read(now, [this](const std::string& text, std::uint64_t left_out) {
      lines.push_back(text);
      left_out_before.push_back(left_out);
    });
  }

  OutputReader output{worker::Descriptor()};
  worker::Descriptor mouth;
  std::vector<std::string> lines;
  std::vector<std::uint64_t> left_out_before;
};

}  // namespace

TEST(OutputReader, AreGivenOnWhenTheyAreCompleteAndTheLastOneAtThePipesEnd) {
  Heard heard;
  heard.say("one\n\ntw");
  heard.listen();
  EXPECT_EQ(heard.lines, std::vector<std::string>{"one"}) << "an empty one says nothing";
  heard.say("o\nlast words");
  heard.listen();
  EXPECT_EQ(heard.lines.size(), 2u);
  EXPECT_GE(heard.output.descriptor(), 0);
  heard.mouth.reset();
  heard.listen();
  EXPECT_EQ(heard.lines, (std::vector<std::string>{"one", "two", "last words"}));
  EXPECT_EQ(heard.output.descriptor(), -1) << "nothing is polled for any more";
  heard.listen();
  EXPECT_EQ(heard.lines.size(), 3u);
}

TEST(OutputReader, AreCutWhereTheyAreTooLong) {
  Heard heard;
  const std::string fits(OutputReader::line_bytes, 'x');
  heard.say(fits + "\n" + fits + "y\n" + std::string(20'000, 'z') + "\nnext\n");
  heard.listen();
  ASSERT_EQ(heard.lines.size(), 4u);
  EXPECT_EQ(heard.lines[0], fits);
  EXPECT_EQ(heard.lines[1], fits);
  EXPECT_EQ(heard.lines[2], std::string(OutputReader::line_bytes, 'z'));
  EXPECT_EQ(heard.lines[3], "next");
}

TEST(OutputReader, AreCountedOnlyWhereThereAreTooManyInAPeriod) {
  Heard heard;
  for (int i = 0; i < OutputReader::lines_per_period + 7; ++i) heard.say("row " + std::to_string(i) + "\n");
  const OutputReader::Time start(std::chrono::hours(1));
  heard.listen(start);
  ASSERT_EQ(heard.lines.size(), static_cast<std::size_t>(OutputReader::lines_per_period));
  EXPECT_EQ(heard.left_out_before.back(), 0u);

  heard.say("still the same\n");
  heard.listen(start + OutputReader::period - std::chrono::nanoseconds(1));
  EXPECT_EQ(heard.lines.size(), static_cast<std::size_t>(OutputReader::lines_per_period));
  heard.say("another\nand one\n");
  heard.listen(start + OutputReader::period);
  ASSERT_EQ(heard.lines.size(), static_cast<std::size_t>(OutputReader::lines_per_period) + 2);
  EXPECT_EQ(heard.lines.back(), "and one");
  EXPECT_EQ(heard.left_out_before.end()[-2], 8u) << "those that were left out are told with the next";
  EXPECT_EQ(heard.left_out_before.back(), 0u) << "once";
}

TEST_F(SupervisorTest, WhatAWorkerSaysComesIntoTheLogUnderItsNumber) {
  start();
  ASSERT_TRUE(reaches(submit("say 2 libpng warning\nfinish done"), JobState::succeeded));
  const std::string worker = "worker=" + std::to_string(supervisor->worker_pid());
  ASSERT_TRUE(eventually([&] { return log.count("worker_output") == 2; }));
  EXPECT_EQ(log.fields("worker_output"), worker + " text=0 libpng warning " + worker + " text=1 libpng warning ");
}

TEST_F(SupervisorTest, TheLastWordsOfAWorkerComeBeforeItsEnd) {
  start();
  const std::string id = submit("say 3 assertion failed\ncrash", 1);
  ASSERT_TRUE(reaches(id, JobState::failed));
  EXPECT_EQ(problem_code(id), "worker_crashed");
  EXPECT_EQ(log.count("worker_output"), 3);
}

TEST_F(SupervisorTest, AWorkerThatSaysMoreThanItsPipeHoldsIsNotHeldUp) {
  start();
  const std::string words(500, 'w');
  ASSERT_TRUE(reaches(submit("say 5000 " + words + "\nfinish done"), JobState::succeeded));
  EXPECT_EQ(log.count("worker_output"), OutputReader::lines_per_period);
}
