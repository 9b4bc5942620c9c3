/// The asset directory without the checks of the reader, which rejects names that lead outside before.

#include "server/worker/protocol/asset_directory.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <system_error>

#include "tests/conformance/memory_file.h"
#include "tests/conformance/temporary_directory.h"

using worker::AssetDirectory;

namespace {

namespace fs = std::filesystem;

class AssetDirectoryTest : public testing::Test {
 protected:
  AssetDirectoryTest() {
    fs::create_directories(inside / "deep");
    write(outside / "secret", "secret");
    write(inside / "file", "content");
  }

  static void write(const fs::path& path, const std::string& text) { std::ofstream(path, std::ios::binary) << text; }

  /// The content, or the reason why there is none, which both functions must return.
  [[nodiscard]] std::string content(const std::string& name) const {
    const AssetDirectory directory(inside);
    const std::string refusal = directory.refusal(name);
    const auto file = directory.open(name);
    EXPECT_EQ(refusal, file ? "" : file.error());
    return file ? text_of(*file) : file.error();
  }

  const TemporaryDirectory directory;
  const fs::path outside = directory.path(), inside = outside / "inside";
};

}  // namespace

TEST_F(AssetDirectoryTest, ReadsItsFiles) {
  write(inside / "deep/binary", std::string("\0\xff\n", 3));
  write(inside / "empty", "");
  EXPECT_EQ(content("file"), "content");
  EXPECT_EQ(content("deep/binary"), std::string("\0\xff\n", 3));
  EXPECT_EQ(content("empty"), "");
}

TEST_F(AssetDirectoryTest, RejectsNamesThatLeadOutside) {
  fs::create_symlink("../secret", inside / "relative");
  fs::create_symlink(outside / "secret", inside / "absolute");
  fs::create_symlink("..", inside / "up");
  fs::create_symlink("up/secret", inside / "twice");
  fs::create_symlink("/proc/self/root" + (inside / "file").string(), inside / "proc");
  for (const char* name : {"../secret", "deep/../../secret", "relative", "absolute", "up/secret", "twice", "proc",
                           "/etc/passwd", "/", "..", "../inside/file"}) {
    EXPECT_EQ(content(name), "leads out of the asset directory") << name;
  }
  EXPECT_EQ(content((inside / "file").string()), "leads out of the asset directory");
}

TEST_F(AssetDirectoryTest, FollowsLinksThatStayInside) {
  fs::create_symlink("../file", inside / "deep/link");
  fs::create_symlink("deep/link", inside / "link");
  EXPECT_EQ(content("link"), "content");
}

TEST_F(AssetDirectoryTest, RejectsSpecialFilesWithoutBlocking) {
  ASSERT_EQ(mkfifo((inside / "pipe").c_str(), 0600), 0);
  fs::create_symlink("loop", inside / "loop");
  EXPECT_EQ(content("pipe"), "is no ordinary file");
  EXPECT_EQ(content("loop"), "Too many levels of symbolic links");
  EXPECT_EQ(content(std::string(256, 'x')), "File name too long");
  EXPECT_EQ(content("deep"), "is no ordinary file");
  EXPECT_EQ(content("."), "is no ordinary file");
  EXPECT_EQ(content("none"), "no such file");
  EXPECT_EQ(content("file/none"), "no such file");
  EXPECT_EQ(content(""), "no such file");
}

TEST_F(AssetDirectoryTest, RejectsFilesAboveTheLimit) {
  write(inside / "large", "");
  fs::resize_file(inside / "large", api::asset_bytes_max);
  EXPECT_EQ(content("large").size(), api::asset_bytes_max);
  fs::resize_file(inside / "large", api::asset_bytes_max + 1);
  EXPECT_EQ(content("large"), "the limit asset_bytes_max is 256000000, it has 256000001");
}

TEST_F(AssetDirectoryTest, ReportsThePathOfAMissingDirectory) {
  for (const fs::path& path : {inside / "none", inside / "file"}) {
    try {
      const AssetDirectory directory(path);
      ADD_FAILURE() << path;
    } catch (const std::system_error& error) {
      EXPECT_NE(std::string(error.what()).find("cannot open the asset directory " + path.string()), std::string::npos);
    }
  }
}
