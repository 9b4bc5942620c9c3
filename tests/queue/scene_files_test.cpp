/// Where a name leads that a document gives a file: to the asset folder or to the uploads.

#include "server/worker/scene_files.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <system_error>

#include "tests/conformance/temporary_folder.h"
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

TEST(SceneFiles, LieInTheFolderThatTheirNameIsOf) {
  const TemporaryFolder folder, uploads;
  write(folder.path() + "/tile.png", "a tile");
  write(uploads.path() + "/ba/" + hash, "an upload");
  const worker::FileSettings settings{folder.path(), uploads.path()};
  EXPECT_EQ(content(settings, "tile.png"), "a tile");
  EXPECT_EQ(content(settings, "sha256:" + hash), "an upload");
  EXPECT_EQ(content(settings, "ba/" + hash), "no such file") << "uploads are reached by their hash alone";
  EXPECT_EQ(content(settings, "sha256:" + std::string(64, '0')), "no such file");
}

TEST(SceneFiles, OfUploadsAreKnownByTheirHashAndOthersByWhenTheyWereChanged) {
  const TemporaryFolder folder, uploads;
  write(folder.path() + "/tile.png", "a tile");
  const SceneFiles files({folder.path(), uploads.path()});
  EXPECT_EQ(files.content_name("sha256:" + hash), "sha256:" + hash) << "unread";
  EXPECT_EQ(files.content_name("tile.png"), "") << "it may change again within a tick of the clock";
  EXPECT_EQ(files.content_name("nothing.png"), "");
  ASSERT_TRUE(eventually([&] { return !files.content_name("tile.png").empty(); }));
  const std::string settled = files.content_name("tile.png");
  EXPECT_EQ(files.content_name("tile.png"), settled);
  EXPECT_FALSE(settled.starts_with("sha256:"));
  write(folder.path() + "/tile.png", "a till");
  EXPECT_EQ(files.content_name("tile.png"), "");
  ASSERT_TRUE(eventually([&] { return !files.content_name("tile.png").empty(); }));
  EXPECT_NE(files.content_name("tile.png"), settled) << "of the same size";
}

TEST(SceneFiles, AreNotThereWhereTheirFolderIsNotGiven) {
  const TemporaryFolder folder;
  write(folder.path() + "/tile.png", "a tile");
  EXPECT_EQ(content({folder.path(), ""}, "tile.png"), "a tile");
  EXPECT_NE(content({folder.path(), ""}, "sha256:" + hash).find("no folder"), std::string::npos);
  EXPECT_NE(content({"", folder.path()}, "tile.png").find("no folder"), std::string::npos);
  EXPECT_THROW(SceneFiles({"", folder.path() + "/nowhere"}), std::system_error);
}
