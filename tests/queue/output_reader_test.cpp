/// The output of a worker is logged line by line, truncated and limited in number.

#include <fcntl.h>
#include <unistd.h>

#include <array>

#include "server/worker/supervisor/child_process.h"
#include "tests/queue/supervised.h"

using queue::JobState;
using worker::OutputReader;

namespace {

/// A pipe and the lines read from it.
class TestPipe {
 public:
  TestPipe() {
    std::array<int, 2> ends{};
    EXPECT_EQ(pipe2(ends.data(), O_CLOEXEC | O_NONBLOCK), 0);
    output = OutputReader(support::Descriptor(ends[0]));
    writer = support::Descriptor(ends[1]);
  }
  void write(const std::string& text) const {
    ASSERT_EQ(::write(writer.get(), text.data(), text.size()), static_cast<ssize_t>(text.size()));
  }
  void read(OutputReader::Time now = {}) {
    output.read(now, [this](const std::string& text, std::uint64_t omitted_lines) {
      lines.push_back(text);
      omitted_before.push_back(omitted_lines);
    });
  }

  OutputReader output{support::Descriptor()};
  support::Descriptor writer;
  std::vector<std::string> lines;
  std::vector<std::uint64_t> omitted_before;
};

}  // namespace

TEST(OutputReader, PassesOnCompleteLinesAndTheLastOneAtTheEndOfThePipe) {
  TestPipe pipe;
  pipe.write("one\n\ntw");
  pipe.read();
  EXPECT_EQ(pipe.lines, std::vector<std::string>{"one"}) << "empty lines are dropped";
  pipe.write("o\nlast line");
  pipe.read();
  EXPECT_EQ(pipe.lines.size(), 2u);
  EXPECT_GE(pipe.output.descriptor(), 0);
  pipe.writer.reset();
  pipe.read();
  EXPECT_EQ(pipe.lines, (std::vector<std::string>{"one", "two", "last line"}));
  EXPECT_EQ(pipe.output.descriptor(), -1) << "the pipe is closed";
  pipe.read();
  EXPECT_EQ(pipe.lines.size(), 3u);
}

TEST(OutputReader, TruncatesLongLines) {
  TestPipe pipe;
  const std::string fits(OutputReader::line_bytes, 'x');
  pipe.write(fits + "\n" + fits + "y\n" + std::string(20'000, 'z') + "\nnext\n");
  pipe.read();
  ASSERT_EQ(pipe.lines.size(), 4u);
  EXPECT_EQ(pipe.lines[0], fits);
  EXPECT_EQ(pipe.lines[1], fits);
  EXPECT_EQ(pipe.lines[2], std::string(OutputReader::line_bytes, 'z'));
  EXPECT_EQ(pipe.lines[3], "next");
}

TEST(OutputReader, CountsOmittedLinesOfAPeriod) {
  TestPipe pipe;
  for (int i = 0; i < OutputReader::lines_per_period + 7; ++i) pipe.write("row " + std::to_string(i) + "\n");
  const OutputReader::Time start(std::chrono::hours(1));
  pipe.read(start);
  ASSERT_EQ(pipe.lines.size(), static_cast<std::size_t>(OutputReader::lines_per_period));
  EXPECT_EQ(pipe.omitted_before.back(), 0u);

  pipe.write("still the same\n");
  pipe.read(start + OutputReader::period - std::chrono::nanoseconds(1));
  EXPECT_EQ(pipe.lines.size(), static_cast<std::size_t>(OutputReader::lines_per_period));
  pipe.write("another\nand one\n");
  pipe.read(start + OutputReader::period);
  ASSERT_EQ(pipe.lines.size(), static_cast<std::size_t>(OutputReader::lines_per_period) + 2);
  EXPECT_EQ(pipe.lines.back(), "and one");
  EXPECT_EQ(pipe.omitted_before.end()[-2], 8u) << "the omitted lines are reported with the next one";
  EXPECT_EQ(pipe.omitted_before.back(), 0u) << "once";
}

TEST_F(SupervisorTest, LogsTheOutputOfAWorkerWithItsPid) {
  start();
  ASSERT_TRUE(reaches(submit("print 2 libpng warning\nfinish done"), JobState::succeeded));
  const std::string worker = "worker=" + std::to_string(supervisor->worker_pid());
  ASSERT_TRUE(eventually([&] { return log.count("worker_output") == 2; }));
  EXPECT_EQ(log.fields("worker_output"), worker + " text=0 libpng warning " + worker + " text=1 libpng warning ");
}

TEST_F(SupervisorTest, LogsTheOutputOfAWorkerBeforeItsExit) {
  start();
  const std::string id = submit("print 3 assertion failed\ncrash", 1);
  ASSERT_TRUE(reaches(id, JobState::failed));
  EXPECT_EQ(problem_code(id), "worker_crashed");
  EXPECT_EQ(log.count("worker_output"), 3);
}

TEST_F(SupervisorTest, DoesNotBlockAWorkerThatFillsItsPipe) {
  start();
  const std::string text(500, 'w');
  ASSERT_TRUE(reaches(submit("print 5000 " + text + "\nfinish done"), JobState::succeeded));
  EXPECT_EQ(log.count("worker_output"), OutputReader::lines_per_period);
}
