/// File names of documents refer to the asset directory or to the uploads.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <system_error>

#include "server/worker/protocol/asset_directory.h"
#include "tests/conformance/temporary_directory.h"
#include "tests/queue/eventually.h"

using worker::SceneFiles;

namespace {

const std::string hash = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";

std::string content(const worker::FileSettings& settings, const std::string& name) {
  const auto bytes = SceneFiles(settings).read(name);
  return bytes ? std::string(bytes->begin(), bytes->end()) : bytes.error();
}

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

TEST(SceneFiles, ReadsNothingWithoutADirectory) {
  const TemporaryDirectory directory;
  write(directory.path() + "/tile.png", "a tile");
  EXPECT_EQ(content({directory.path(), ""}, "tile.png"), "a tile");
  EXPECT_NE(content({directory.path(), ""}, "sha256:" + hash).find("no directory"), std::string::npos);
  EXPECT_NE(content({"", directory.path()}, "tile.png").find("no directory"), std::string::npos);
  EXPECT_THROW(SceneFiles({"", directory.path() + "/nowhere"}), std::system_error);
}
