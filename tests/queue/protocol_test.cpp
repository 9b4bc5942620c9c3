/// Messages there and back, and everything a broken worker could send.

#include "server/worker/protocol/protocol.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/socket.h>

#include <array>
#include <cstring>
#include <random>

#include "server/worker/protocol/serialization.h"

using namespace worker;

namespace {

class Protocol : public testing::Test {
 protected:
  Protocol() {
    std::array<int, 2> ends{};
    if (socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0, ends.data()) != 0) abort();
    ours = Descriptor(ends[0]);
    theirs = Descriptor(ends[1]);
  }

  template <class Kind>
  Kind there_and_back(Message message) {
    EXPECT_EQ(send(theirs.get(), pack(std::move(message))), Sent::yes);
    Received received = receive(ours.get(), worker_body_limit);
    if (auto* malformed = std::get_if<Malformed>(&received)) ADD_FAILURE() << malformed->detail;
    return std::get<Kind>(std::get<Message>(std::move(received)));
  }

  /// How receive calls what was sent as these bytes.
  std::string verdict(const std::string& bytes, std::vector<Descriptor> files = {}) {
    EXPECT_EQ(send(theirs.get(), Packet{bytes, std::move(files)}), Sent::yes);
    const Received received = receive(ours.get(), worker_body_limit);
    if (const auto* malformed = std::get_if<Malformed>(&received)) return malformed->detail;
    return "index " + std::to_string(received.index());
  }

  Descriptor ours, theirs;
};

std::string text_of(const Descriptor& file) {
  std::string text(static_cast<std::size_t>(lseek(file.get(), 0, SEEK_END)), '\0');
  EXPECT_EQ(pread(file.get(), text.data(), text.size(), 0), static_cast<ssize_t>(text.size()));
  return text;
}

Finished finished_with_two_images(const std::string& report) {
  Finished finished{"job", 42, report, {}};
  finished.images.push_back({"image.png", "image/png", sealed_memory("png bytes")});
  finished.images.push_back({"image.exr", "image/x-exr", sealed_memory(std::string(1 << 20, 'e'))});
  return finished;
}

}  // namespace

TEST_F(Protocol, BringsEveryMessageAsItWasSent) {
  const auto assign = there_and_back<Assign>(Assign{"job", 1ll << 60, 2.5, std::string("a\0b", 3)});
  EXPECT_EQ(assign.job_id, "job");
  EXPECT_EQ(assign.fence, 1ll << 60);
  EXPECT_EQ(assign.queue_ms, 2.5);
  EXPECT_EQ(assign.document, std::string("a\0b", 3));
  EXPECT_EQ(assign.kind, "render");
  EXPECT_FALSE(assign.large);
  EXPECT_TRUE(there_and_back<Assign>(Assign{"job", 1, 0, "{}", "render", true}).large);
  EXPECT_EQ(there_and_back<Assign>(Assign{"job", 1, 0, "{}", "measure"}).kind, "measure");
  EXPECT_EQ(there_and_back<Look>(Look{"job", 512}).side, 512u);
  const auto looked = there_and_back<Looked>(Looked{"job", 64, std::string(100'000, 'p')});
  EXPECT_EQ(looked.side, 64u);
  EXPECT_EQ(looked.png, std::string(100'000, 'p'));
  EXPECT_EQ(there_and_back<Cancel>(Cancel{"job"}).job_id, "job");
  EXPECT_EQ(there_and_back<Hello>(Hello{"0.1.0"}).build, "0.1.0");
  EXPECT_EQ(there_and_back<Hello>(Hello{"0.1.0", "seccomp"}).sandbox, "seccomp");
  there_and_back<Heartbeat>(Heartbeat{});
  const auto progress = there_and_back<Progress>(Progress{"job", 3, ~0ull});
  EXPECT_EQ(progress.tiles_done, 3u);
  EXPECT_EQ(progress.tiles_total, ~0ull);
  const auto cancelled = there_and_back<Cancelled>(Cancelled{"job", -1});
  EXPECT_EQ(cancelled.fence, -1);
  const auto failed = there_and_back<Failed>(Failed{"job", 7, {"code", "detail", {{"/p", "c", "d"}, {"", "", ""}}}});
  EXPECT_EQ(failed.problem.code, "code");
  EXPECT_EQ(failed.problem.detail, "detail");
  EXPECT_EQ(failed.problem.errors, (std::vector<tracer::Issue>{{"/p", "c", "d"}, {"", "", ""}}));
}

TEST_F(Protocol, HandsImagesOverWithSmallAndWithLargeReports) {
  for (const std::size_t report_bytes : {0u, 10u, 4000u, 4096u, 5000u, 3u << 20}) {
    const auto finished = there_and_back<Finished>(finished_with_two_images(std::string(report_bytes, 'r')));
    EXPECT_EQ(finished.report, std::string(report_bytes, 'r'));
    ASSERT_EQ(finished.images.size(), 2u);
    EXPECT_EQ(finished.images[0].name, "image.png");
    EXPECT_EQ(finished.images[1].media_type, "image/x-exr");
    EXPECT_EQ(text_of(finished.images[0].bytes), "png bytes");
    EXPECT_EQ(text_of(finished.images[1].bytes), std::string(1 << 20, 'e'));
  }
}

TEST_F(Protocol, CarriesADocumentOf64MiB) {
  std::string document(64u << 20, 'x');
  document.back() = 'y';
  EXPECT_EQ(send(theirs.get(), pack(Assign{"job", 1, 0, document})), Sent::yes);
  Received received = receive(ours.get(), daemon_body_limit);
  EXPECT_EQ(std::get<Assign>(std::get<Message>(received)).document, document);
}

TEST_F(Protocol, ReceivedDescriptorsAreNotInherited) {
  const auto finished = there_and_back<Finished>(finished_with_two_images("{}"));
  for (const Image& image : finished.images) EXPECT_EQ(fcntl(image.bytes.get(), F_GETFD), FD_CLOEXEC);
}

TEST_F(Protocol, TellsNothingToReadFromTheOtherEndGone) {
  EXPECT_TRUE(std::holds_alternative<Nothing>(receive(ours.get(), worker_body_limit)));
  theirs.reset();
  EXPECT_TRUE(std::holds_alternative<Closed>(receive(ours.get(), worker_body_limit)));
  EXPECT_EQ(send(ours.get(), pack(Heartbeat{})), Sent::closed);
}

TEST_F(Protocol, SaysLaterWhenTheSocketIsFullAndKeepsPacketsWhole) {
  const Packet packet = pack(Hello{std::string(3000, 'h')});
  int sent = 0;
  while (send(theirs.get(), packet) == Sent::yes) ++sent;
  EXPECT_EQ(send(theirs.get(), packet), Sent::later);
  EXPECT_GE(sent, 32) << "room for a packet per slot";
  for (int i = 0; i < sent; ++i) {
    Received received = receive(ours.get(), worker_body_limit);
    EXPECT_EQ(std::get<Hello>(std::get<Message>(received)).build.size(), 3000u);
  }
  EXPECT_EQ(send(theirs.get(), packet), Sent::yes);
}

TEST_F(Protocol, RefusesWhatIsNoMessage) {
  const std::string good = pack(Failed{"job", 7, {"code", "detail", {{"/p", "c", "d"}}}}).bytes;
  EXPECT_EQ(verdict(good), "index 0");
  EXPECT_EQ(verdict("x"), "a packet without a header");
  EXPECT_NE(verdict(std::string(40, '\xff')).find("protocol version 4294967295"), std::string::npos);
  EXPECT_EQ(verdict(std::string(6000, 'x')), "a packet larger than any of ours");

  std::string other_version = good, unknown_kind = good, huge = good;
  other_version[0] ^= 2;
  unknown_kind[4] = 100;
  const std::uint64_t claimed = 1ull << 40;
  std::memcpy(huge.data() + 8, &claimed, sizeof claimed);
  EXPECT_NE(verdict(other_version).find("protocol version"), std::string::npos);
  EXPECT_NE(verdict(unknown_kind).find("kind 100"), std::string::npos);
  EXPECT_NE(verdict(huge).find("1099511627776 bytes"), std::string::npos);
  EXPECT_EQ(verdict(good + "x"), "a packet of the wrong size");
  EXPECT_EQ(verdict(good.substr(0, good.size() - 1)), "a packet of the wrong size");
}

TEST_F(Protocol, RefusesEveryPrefixWhoseSizeFieldWasAdjusted) {
  const std::string good = pack(Failed{"job", 7, {"code", "detail", {{"/p", "c", "d"}}}}).bytes;
  for (std::size_t size = 16; size < good.size(); ++size) {
    std::string cut = good.substr(0, size);
    const std::uint64_t body = size - 16;
    std::memcpy(cut.data() + 8, &body, sizeof body);
    EXPECT_EQ(verdict(cut), "a message of kind 6 with a broken body") << size;
  }
}

TEST_F(Protocol, RefusesDescriptorsTooManyTooFewOrUnsealed) {
  const std::string heartbeat = pack(Heartbeat{}).bytes;
  const auto one = [](Descriptor file) {
    std::vector<Descriptor> files;
    files.push_back(std::move(file));
    return files;
  };
  EXPECT_NE(verdict(heartbeat, one(sealed_memory("x"))).find("broken body"), std::string::npos);
  EXPECT_NE(verdict(pack(finished_with_two_images("{}")).bytes).find("broken body"), std::string::npos);
  EXPECT_EQ(verdict(heartbeat, one(Descriptor(memfd_create("open", MFD_CLOEXEC)))),
            "a descriptor that is no sealed memory");
  EXPECT_EQ(verdict(heartbeat, one(Descriptor(open("/dev/zero", O_RDONLY | O_CLOEXEC)))),
            "a descriptor that is no sealed memory");
}

TEST_F(Protocol, RefusesALargeBodyThatIsNotWhatItsHeaderSays) {
  Packet packet = pack(Hello{std::string(10'000, 'h')});
  const std::string header = packet.bytes;
  EXPECT_EQ(verdict(header), "a large body that is not there");
  std::vector<Descriptor> shorter;
  shorter.push_back(sealed_memory(std::string(9'999, 'h')));
  EXPECT_EQ(verdict(header, std::move(shorter)), "a large body that is not there");
  EXPECT_EQ(verdict(header + "x", std::move(packet.files)), "a large body that is not there");
}

TEST_F(Protocol, SurvivesRandomBytesWithValidHeaders) {
  std::mt19937 random(7);
  for (int i = 0; i < 20'000; ++i) {
    std::string bytes(16 + random() % 120, '\0');
    const std::uint32_t version = protocol_version, kind = static_cast<std::uint32_t>(random() % 11);
    const std::uint64_t size = bytes.size() - 16;
    std::memcpy(bytes.data(), &version, 4);
    std::memcpy(bytes.data() + 4, &kind, 4);
    std::memcpy(bytes.data() + 8, &size, 8);
    for (std::size_t at = 16; at < bytes.size(); ++at) {
      bytes[at] = static_cast<char>(random() % 4 != 0 ? 0 : random());  // mostly zeros: lengths that are believable
    }
    ASSERT_EQ(send(theirs.get(), Packet{bytes, {}}), Sent::yes);
    const Received received = receive(ours.get(), worker_body_limit);
    ASSERT_TRUE(std::holds_alternative<Message>(received) || std::holds_alternative<Malformed>(received));
  }
}
