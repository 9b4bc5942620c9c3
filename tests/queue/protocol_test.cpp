/// Round trips of all messages, and packets of a faulty worker.

#include "server/worker/protocol/protocol.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/socket.h>

#include <array>
#include <cstring>
#include <random>

#include "tests/conformance/memory_file.h"

using namespace worker;

namespace {

class Protocol : public testing::Test {
 protected:
  Protocol() {
    std::array<int, 2> ends{};
    if (socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0, ends.data()) != 0) abort();
    daemon_end = Descriptor(ends[0]);
    worker_end = Descriptor(ends[1]);
  }

  template <class Kind>
  Kind round_trip(Message message) {
    EXPECT_EQ(send(worker_end.get(), pack(std::move(message))), Sent::yes);
    Received received = receive(daemon_end.get(), worker_body_limit);
    if (auto* malformed = std::get_if<Malformed>(&received)) ADD_FAILURE() << malformed->detail;
    return std::get<Kind>(std::get<Message>(std::move(received)));
  }

  /// The result of receive for a packet with these bytes.
  std::string result_of(const std::string& bytes, std::vector<Descriptor> files = {}) {
    EXPECT_EQ(send(worker_end.get(), Packet{bytes, std::move(files)}), Sent::yes);
    const Received received = receive(daemon_end.get(), worker_body_limit);
    if (const auto* malformed = std::get_if<Malformed>(&received)) return malformed->detail;
    return "index " + std::to_string(received.index());
  }

  Descriptor daemon_end, worker_end;
};

Finished finished_with_two_images(const std::string& report) {
  Finished finished{"job", 42, report, {}};
  finished.images.push_back({"image.png", "image/png", sealed_memory("png bytes")});
  finished.images.push_back({"image.exr", "image/x-exr", sealed_memory(std::string(1 << 20, 'e'))});
  return finished;
}

}  // namespace

TEST_F(Protocol, TransportsEveryMessage) {
  const auto assign = round_trip<Assign>(Assign{"job", 1ll << 60, 2.5, std::string("a\0b", 3)});
  EXPECT_EQ(assign.job_id, "job");
  EXPECT_EQ(assign.fence, 1ll << 60);
  EXPECT_EQ(assign.queue_ms, 2.5);
  EXPECT_EQ(assign.document, std::string("a\0b", 3));
  EXPECT_EQ(assign.kind, "render");
  EXPECT_FALSE(assign.large);
  EXPECT_TRUE(round_trip<Assign>(Assign{"job", 1, 0, "{}", "render", true}).large);
  EXPECT_EQ(round_trip<Assign>(Assign{"job", 1, 0, "{}", "measure"}).kind, "measure");
  EXPECT_EQ(round_trip<PreviewRequest>(PreviewRequest{"job", 512}).side, 512u);
  const auto response = round_trip<PreviewResponse>(PreviewResponse{"job", 64, std::string(100'000, 'p')});
  EXPECT_EQ(response.side, 64u);
  EXPECT_EQ(response.png, std::string(100'000, 'p'));
  const Options options{7, 3, 1ull << 41, 1ull << 42, 12'345, {"/a directory", "/uploads", 123, 1ull << 40}};
  const auto configure = round_trip<Configure>(Configure{options, sealed_memory("file")});
  EXPECT_EQ(configure.options, options);
  EXPECT_EQ(text_of(configure.file_socket), "file");
  EXPECT_TRUE(round_trip<FileRequest>(FileRequest{"a.obj", true}).content_name_only);
  FileResponse file{"", true, "refused", "name", {}};
  file.file.push_back(sealed_memory("file"));
  const auto answer = round_trip<FileResponse>(std::move(file));
  EXPECT_EQ(answer.refusal + answer.content_name + text_of(answer.file.at(0)), "refusednamefile");
  EXPECT_TRUE(answer.unavailable);
  EXPECT_EQ(round_trip<Cancel>(Cancel{"job"}).job_id, "job");
  EXPECT_EQ(round_trip<Ready>(Ready{"0.1.0"}).build, "0.1.0");
  EXPECT_EQ(round_trip<Ready>(Ready{"0.1.0", "seccomp"}).sandbox, "seccomp");
  round_trip<Heartbeat>(Heartbeat{});
  EXPECT_TRUE(round_trip<Assign>(Assign{"job", 1, 0, "{}", "render", false, true}).divisible);
  const auto published = round_trip<PublishTasks>(PublishTasks{"job", {{"a", std::string(9000, 'p')}, {"b", {}}}});
  EXPECT_EQ(published.tasks.at(0).part.size(), 9000u);
  EXPECT_EQ(published.tasks.at(1).key, "b");
  EXPECT_EQ(round_trip<TakeTask>(TakeTask{"job"}).job_id, "job");
  EXPECT_EQ(round_trip<TaskTaken>(TaskTaken{"job", "key", 3}).attempt, 3);
  EXPECT_EQ(round_trip<TraceTask>(TraceTask{"job", "key", "{}", "part"}).part, "part");
  EXPECT_TRUE(round_trip<TaskTraced>(TaskTraced{"job", "key", true, {}}).failed);
  EXPECT_EQ(round_trip<TaskDone>(TaskDone{"job", "key", "node", 2, "result"}).result, "result");
  EXPECT_EQ(round_trip<Helpers>(Helpers{7}).count, 7);
  const auto progress = round_trip<Progress>(Progress{"job", 3, ~0ull});
  EXPECT_EQ(progress.tiles_done, 3u);
  EXPECT_EQ(progress.tiles_total, ~0ull);
  const auto cancelled = round_trip<Cancelled>(Cancelled{"job", -1});
  EXPECT_EQ(cancelled.fence, -1);
  const auto failed = round_trip<Failed>(Failed{"job", 7, {"code", "detail", {{"/p", "c", "d"}, {"", "", ""}}}});
  EXPECT_EQ(failed.problem.code, "code");
  EXPECT_EQ(failed.problem.detail, "detail");
  EXPECT_EQ(failed.problem.errors, (std::vector<tracer::Issue>{{"/p", "c", "d"}, {"", "", ""}}));
}

TEST_F(Protocol, TransportsImagesWithSmallAndLargeReports) {
  for (const std::size_t report_bytes : {0u, 10u, 4000u, 4096u, 5000u, 3u << 20}) {
    const auto finished = round_trip<Finished>(finished_with_two_images(std::string(report_bytes, 'r')));
    EXPECT_EQ(finished.report, std::string(report_bytes, 'r'));
    ASSERT_EQ(finished.images.size(), 2u);
    EXPECT_EQ(finished.images[0].name, "image.png");
    EXPECT_EQ(finished.images[1].media_type, "image/x-exr");
    EXPECT_EQ(text_of(finished.images[0].bytes), "png bytes");
    EXPECT_EQ(text_of(finished.images[1].bytes), std::string(1 << 20, 'e'));
  }
}

TEST_F(Protocol, TransportsADocumentOf64MiB) {
  std::string document(64u << 20, 'x');
  document.back() = 'y';
  EXPECT_EQ(send(worker_end.get(), pack(Assign{"job", 1, 0, document})), Sent::yes);
  Received received = receive(daemon_end.get(), daemon_body_limit);
  EXPECT_EQ(std::get<Assign>(std::get<Message>(received)).document, document);
}

TEST_F(Protocol, MarksReceivedDescriptorsCloseOnExec) {
  const auto finished = round_trip<Finished>(finished_with_two_images("{}"));
  for (const Image& image : finished.images) EXPECT_EQ(fcntl(image.bytes.get(), F_GETFD), FD_CLOEXEC);
}

TEST_F(Protocol, DistinguishesAnEmptySocketFromAClosedOne) {
  EXPECT_TRUE(std::holds_alternative<Nothing>(receive(daemon_end.get(), worker_body_limit)));
  worker_end.reset();
  EXPECT_TRUE(std::holds_alternative<Closed>(receive(daemon_end.get(), worker_body_limit)));
  EXPECT_EQ(send(daemon_end.get(), pack(Heartbeat{})), Sent::closed);
}

TEST_F(Protocol, ReturnsLaterForAFullSocketAndKeepsPacketsComplete) {
  const Packet packet = pack(Ready{std::string(3000, 'h')});
  int sent = 0;
  while (send(worker_end.get(), packet) == Sent::yes) ++sent;
  EXPECT_EQ(send(worker_end.get(), packet), Sent::later);
  EXPECT_GE(sent, 32) << "room for a packet per slot";
  for (int i = 0; i < sent; ++i) {
    Received received = receive(daemon_end.get(), worker_body_limit);
    EXPECT_EQ(std::get<Ready>(std::get<Message>(received)).build.size(), 3000u);
  }
  EXPECT_EQ(send(worker_end.get(), packet), Sent::yes);
}

TEST_F(Protocol, RejectsInvalidPackets) {
  const std::string good = pack(Failed{"job", 7, {"code", "detail", {{"/p", "c", "d"}}}}).bytes;
  EXPECT_EQ(result_of(good), "index 0");
  EXPECT_EQ(result_of("x"), "a packet without a header");
  EXPECT_NE(result_of(std::string(40, '\xff')).find("protocol version 4294967295"), std::string::npos);
  EXPECT_EQ(result_of(std::string(6000, 'x')), "a packet that is too large");

  std::string other_version = good, unknown_kind = good, huge = good;
  other_version[0] ^= 2;
  unknown_kind[4] = 100;
  const std::uint64_t claimed = 1ull << 40;
  std::memcpy(huge.data() + 8, &claimed, sizeof claimed);
  EXPECT_NE(result_of(other_version).find("protocol version"), std::string::npos);
  EXPECT_NE(result_of(unknown_kind).find("kind 100"), std::string::npos);
  EXPECT_NE(result_of(huge).find("1099511627776 bytes"), std::string::npos);
  EXPECT_EQ(result_of(good + "x"), "a packet of the wrong size");
  EXPECT_EQ(result_of(good.substr(0, good.size() - 1)), "a packet of the wrong size");
}

TEST_F(Protocol, RejectsEveryPrefixWithAdjustedSize) {
  const std::string good = pack(Failed{"job", 7, {"code", "detail", {{"/p", "c", "d"}}}}).bytes;
  for (std::size_t size = 16; size < good.size(); ++size) {
    std::string cut = good.substr(0, size);
    const std::uint64_t body = size - 16;
    std::memcpy(cut.data() + 8, &body, sizeof body);
    EXPECT_EQ(result_of(cut), "a message of kind 6 with an invalid body") << size;
  }
}

TEST_F(Protocol, RejectsWrongNumbersOfDescriptorsAndUnsealedOnes) {
  const std::string heartbeat = pack(Heartbeat{}).bytes;
  const auto one = [](Descriptor file) {
    std::vector<Descriptor> files;
    files.push_back(std::move(file));
    return files;
  };
  EXPECT_NE(result_of(heartbeat, one(sealed_memory("x"))).find("invalid body"), std::string::npos);
  EXPECT_NE(result_of(pack(finished_with_two_images("{}")).bytes).find("invalid body"), std::string::npos);
  EXPECT_EQ(result_of(heartbeat, one(Descriptor(memfd_create("open", MFD_CLOEXEC)))),
            "a descriptor that is not sealed memory");
  EXPECT_EQ(result_of(heartbeat, one(Descriptor(open("/dev/zero", O_RDONLY | O_CLOEXEC)))),
            "a descriptor that is not sealed memory");
}

TEST_F(Protocol, RejectsALargeBodyOfAnotherSize) {
  Packet packet = pack(Ready{std::string(10'000, 'h')});
  const std::string header = packet.bytes;
  EXPECT_EQ(result_of(header), "a large body without its memory");
  std::vector<Descriptor> shorter;
  shorter.push_back(sealed_memory(std::string(9'999, 'h')));
  EXPECT_EQ(result_of(header, std::move(shorter)), "a large body without its memory");
  EXPECT_EQ(result_of(header + "x", std::move(packet.files)), "a large body without its memory");
}

TEST_F(Protocol, SurvivesRandomBytesWithValidHeaders) {
  std::mt19937 random(7);
  for (int i = 0; i < 20'000; ++i) {
    std::string bytes(16 + random() % 120, '\0');
    const std::uint32_t version = protocol_version,
                        kind = static_cast<std::uint32_t>(random() % std::variant_size_v<Message>);
    const std::uint64_t size = bytes.size() - 16;
    std::memcpy(bytes.data(), &version, 4);
    std::memcpy(bytes.data() + 4, &kind, 4);
    std::memcpy(bytes.data() + 8, &size, 8);
    for (std::size_t at = 16; at < bytes.size(); ++at) {
      bytes[at] = static_cast<char>(random() % 4 != 0 ? 0 : random());  // mostly zeros, for plausible lengths
    }
    ASSERT_EQ(send(worker_end.get(), Packet{bytes, {}}), Sent::yes);
    const Received received = receive(daemon_end.get(), worker_body_limit);
    ASSERT_TRUE(std::holds_alternative<Message>(received) || std::holds_alternative<Malformed>(received));
  }
}
