/// File names of documents refer to the asset directory or to the uploads.

#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <memory>
#include <system_error>

#include "server/worker/protocol/asset_directory.h"
#include "server/worker/supervisor/file_server.h"
#include "tests/conformance/memory_file.h"
#include "tests/conformance/temporary_directory.h"
#include "tests/support/threads.h"

using worker::SceneFiles;

namespace {

const std::string hash = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";

std::string content(const worker::FileSettings& settings, const std::string& name) {
  const auto file = SceneFiles(settings).open(name);
  return file ? text_of(*file) : file.error();
}

/// A server of files, and the end of the worker.
class Connection {
 public:
  explicit Connection(const worker::FileSettings& settings) {
    std::array<int, 2> ends{};
    if (socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends.data()) != 0) abort();
    socket_ = worker::Descriptor(ends[1]);
    server_ = std::make_unique<worker::FileServer>(worker::Descriptor(ends[0]), settings);
  }
  [[nodiscard]] int socket() const { return socket_.get(); }
  worker::FileResponse request(worker::FileRequest request) {
    EXPECT_EQ(worker::send(socket(), worker::pack(std::move(request))), worker::Sent::yes);
    auto received = worker::receive(socket(), 1 << 20, worker::FileRule::any);
    return std::get<worker::FileResponse>(std::get<worker::Message>(std::move(received)));
  }

 private:
  worker::Descriptor socket_;
  std::unique_ptr<worker::FileServer> server_;
};

void write(const std::string& path, const std::string& text) {
  std::filesystem::create_directories(std::filesystem::path(path).parent_path());
  std::ofstream(path, std::ios::binary) << text;
}

}  // namespace

TEST(SceneFiles, ReadsFromTheDirectoryOfTheName) {
  const TemporaryDirectory directory, uploads;
  write(directory.path() + "/tile.png", "a tile");
  write(uploads.path() + "/ba/" + hash, "an upload");
  const worker::FileSettings settings{directory.path(), uploads.path()};
  EXPECT_EQ(content(settings, "tile.png"), "a tile");
  EXPECT_EQ(content(settings, "sha256:" + hash), "an upload");
  EXPECT_EQ(content(settings, "ba/" + hash), "no such file") << "uploads are reached by their hash alone";
  EXPECT_EQ(content(settings, "sha256:" + std::string(64, '0')), "no such file");
}

TEST(SceneFiles, IdentifiesUploadsByHashAndOtherFilesByStamp) {
  const TemporaryDirectory directory, uploads;
  write(directory.path() + "/tile.png", "a tile");
  const SceneFiles files({directory.path(), uploads.path()});
  EXPECT_EQ(files.content_name("sha256:" + hash), "sha256:" + hash) << "unread";
  EXPECT_EQ(files.content_name("tile.png"), "") << "it may change again within a tick of the clock";
  EXPECT_EQ(files.content_name("nothing.png"), "");
  ASSERT_TRUE(eventually([&] { return !files.content_name("tile.png").empty(); }));
  const std::string on_waiters_notified = files.content_name("tile.png");
  EXPECT_EQ(files.content_name("tile.png"), on_waiters_notified);
  EXPECT_FALSE(on_waiters_notified.starts_with("sha256:"));
  write(directory.path() + "/tile.png", "a till");
  EXPECT_EQ(files.content_name("tile.png"), "");
  ASSERT_TRUE(eventually([&] { return !files.content_name("tile.png").empty(); }));
  EXPECT_NE(files.content_name("tile.png"), on_waiters_notified) << "of the same size";
}

TEST(FileServer, OpensFilesOfScenesForReadingOnly) {
  const TemporaryDirectory directory;
  write(directory.path() + "/tile.png", "a tile");
  Connection connection({directory.path(), ""});
  const worker::FileResponse tile = connection.request({"tile.png"});
  ASSERT_EQ(tile.file.size(), 1u);
  EXPECT_EQ(text_of(tile.file[0]), "a tile");
  EXPECT_EQ(::write(tile.file[0].get(), "x", 1), -1) << "for reading";
  EXPECT_TRUE(connection.request({"tile.png", true}).file.empty());
  for (const char* const name : {"/etc/passwd", "../tile.png", ".", "", "sha256:../../etc/passwd"}) {
    const worker::FileResponse refused = connection.request({name});
    EXPECT_TRUE(refused.file.empty() && !refused.refusal.empty()) << name;
  }
}

TEST(FileServer, ReportsThatItCannotOpenFiles) {
  Connection connection({"/nowhere", ""});
  EXPECT_NE(connection.request({"tile.png"}).failure.find("/nowhere"), std::string::npos);
}

TEST(FileServer, ClosesTheConnectionOfAFaultyWorker) {
  Connection connection({});
  EXPECT_EQ(worker::send(connection.socket(), worker::pack(worker::Heartbeat{})), worker::Sent::yes);
  pollfd wanted{connection.socket(), POLLIN, 0};
  EXPECT_EQ(poll(&wanted, 1, 60'000), 1);
  EXPECT_EQ(worker::receive(connection.socket(), 1000).index(), worker::Received(worker::Closed{}).index());
}

TEST(SceneFiles, ReadsNothingWithoutADirectory) {
  const TemporaryDirectory directory;
  write(directory.path() + "/tile.png", "a tile");
  EXPECT_EQ(content({directory.path(), ""}, "tile.png"), "a tile");
  EXPECT_NE(content({directory.path(), ""}, "sha256:" + hash).find("no directory"), std::string::npos);
  EXPECT_NE(content({"", directory.path()}, "tile.png").find("no directory"), std::string::npos);
  EXPECT_THROW(SceneFiles({"", directory.path() + "/nowhere"}), std::system_error);
}
