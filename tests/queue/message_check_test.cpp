/// Messages that a worker must not send, although the protocol transports them.

#include "server/worker/supervisor/message_check.h"

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

#include "server/queue/job_waiters.h"

using namespace worker;

namespace {

/// Sparse: its bytes cost nothing.
Image file(const std::string& name, const std::string& media_type, std::uint64_t bytes = 10) {
  Descriptor memory(memfd_create("file", MFD_CLOEXEC));
  EXPECT_EQ(ftruncate(memory.get(), static_cast<off_t>(bytes)), 0);
  return {name, media_type, std::move(memory)};
}

template <class... Files>
Finished result(Files... files) {
  Finished finished{"job", 1, "{}", {}};
  (finished.images.push_back(std::move(files)), ...);
  return finished;
}

queue::Job job_of(queue::JobKind kind) {
  queue::Job job;
  job.kind = kind;
  job.width = job.height = 16;
  job.formats = "png 16.png exr";
  return job;
}
const queue::Job render = job_of(queue::JobKind::render), measure = job_of(queue::JobKind::measure);

std::string violation_of(const Finished& result, const queue::Job& job) {
  const auto figures = check_result(result, job);
  return figures ? "" : figures.error();
}

std::string violation_of_problem(const std::string& code, const std::string& detail, std::size_t issues = 0) {
  return violation_of(Message(Failed{"job", 1, {code, detail, std::vector<tracer::Issue>(issues)}}));
}

}  // namespace

TEST(MessageCheck, AcceptsTheFilesOfRendersAndMeasurements) {
  EXPECT_EQ(violation_of(result(file("image.png", "image/png"), file("image.16.png", "image/png"),
                                file("image.exr", "image/x-exr", image_bytes_max(16, 16))),
                         render),
            "");
  Finished all{"job", 1, "{}", {}};
  for (const FileType& type : measurement_files) all.images.push_back(file(type.name, type.media_type));
  EXPECT_EQ(violation_of(all, measure), "");
}

TEST(MessageCheck, RejectsFilesThatTheJobCannotHave) {
  for (const char* const name : {"image.html", "image.png/../../x", "../image.png", "/etc/passwd", "", "image", "a\nb",
                                 "measure.png", "image.png ", "image.jpg", "image."})
    EXPECT_EQ(violation_of(result(file(name, "image/png")), render), "sent a result with an invalid file name") << name;
  EXPECT_EQ(violation_of(result(file("image.png", "image/png")), measure), "sent a result with an invalid file name");
  EXPECT_EQ(violation_of(result(file("image.png", "image/png"), file("image.png", "image/png")), render),
            "sent a result with an invalid file name");
  for (const char* const type : {"text/html", "image/svg+xml", "image/jpeg", "", "image/png\r\nSet-Cookie: a"})
    EXPECT_EQ(violation_of(result(file("image.png", type)), render), "sent a result with an invalid media type");
  EXPECT_EQ(violation_of(result(), render), "sent a result without files");
}

TEST(MessageCheck, BoundsFilesByTheSizeOfTheImage) {
  const std::uint64_t most = image_bytes_max(16, 16);
  EXPECT_EQ(most, 65536u + 16 * 16 * 64);
  EXPECT_NE(violation_of(result(file("image.png", "image/png", most + 1)), render), "");
  EXPECT_NE(violation_of(result(file("image.exr", "image/x-exr", std::uint64_t{5} << 30)), render), "");
  EXPECT_NE(violation_of(result(file("measure.csv", "text/csv", measurement_bytes_max + 1)), measure), "");
  EXPECT_GT(image_bytes_max(0xFFFFFFFF, 1), std::uint64_t{63} << 32) << "no overflow of 32 bits";
  Finished without_file = result(file("image.png", "image/png"));
  without_file.images[0].bytes.reset();
  EXPECT_NE(violation_of(without_file, render), "");
}

TEST(MessageCheck, RejectsReportsThatTheDaemonCannotRead) {
  for (const std::string& report : {std::string(), std::string("[]"), std::string("{"), std::string("\xff"),
                                    R"({"a":)" + std::string(100'000, '[') + std::string(100'000, ']') + "}"}) {
    Finished finished = result(file("image.png", "image/png"));
    finished.report = report;
    EXPECT_EQ(violation_of(finished, render), "sent a result without a valid report") << report.substr(0, 10);
  }
}

TEST(MessageCheck, BoundsProblemsAndListsTheirCodes) {
  for (const char* const code : {"bad_scene", "bad_asset", "out_of_memory", "internal", "assets_unavailable"})
    EXPECT_EQ(violation_of_problem(code, "sentence", 1000), "");
  for (const char* const code : {"", "worker_crashed", "storage_failure", "deadline_exceeded", "x"})
    EXPECT_NE(violation_of_problem(code, "sentence"), "") << code;
  EXPECT_NE(violation_of_problem("internal", std::string(2 << 20, 'x')), "");
  EXPECT_NE(violation_of_problem("internal", "", 1001), "");
}

TEST(MessageCheck, BoundsNamesAndPreviews) {
  EXPECT_EQ(violation_of(Message(Ready{"0.1.0", "seccomp, landlock"})), "");
  EXPECT_NE(violation_of(Message(Ready{std::string(257, 'x')})), "");
  EXPECT_NE(violation_of(Message(Ready{"0.1.0", "a\nb"})), "");
  const auto preview = [](std::uint32_t side, std::size_t bytes) {
    return violation_of(Message(PreviewResponse{"job", side, std::string(bytes, 'p')}));
  };
  EXPECT_EQ(preview(queue::preview_side_max, 1 << 20), "");
  EXPECT_NE(preview(queue::preview_side_max + 1, 10), "");
  EXPECT_NE(preview(0, 10), "");
  EXPECT_NE(preview(1, 1 << 20), "");
}

TEST(MessageCheck, RejectsMessagesOfTheDaemon) {
  const Message all[] = {Cancel{"job"}, PreviewRequest{"job", 1}, TraceTask{}, TaskTaken{}, TaskDone{}, Helpers{}};
  for (const Message& message : all) EXPECT_EQ(violation_of(message), "sent a message that only the daemon sends");
}

TEST(MessageCheck, RejectsTasksThatCannotBeStored) {
  const std::string key(64, 'a');
  EXPECT_EQ(violation_of(Message(PublishTasks{"job", {{key, "part"}}})), "");
  EXPECT_EQ(violation_of(Message(TaskTraced{"job", key, false, "result"})), "");
  for (const std::string& bad : {std::string(), std::string(63, 'a'), std::string(64, 'g')}) {
    EXPECT_EQ(violation_of(Message(PublishTasks{"job", {{key, ""}, {bad, ""}}})), "sent an invalid task");
    EXPECT_EQ(violation_of(Message(TaskTraced{"job", bad, false, {}})), "sent an invalid result of a task");
  }
  const std::string large(task_bytes_max + 1, 'x');
  EXPECT_EQ(violation_of(Message(PublishTasks{"job", {{key, large}}})), "sent an invalid task");
  EXPECT_EQ(violation_of(Message(TaskTraced{"job", key, false, large})), "sent an invalid result of a task");
}
