/// The ballast on a small disk: a tmpfs, which only root can mount.

#include "server/storage/files/disk_space_monitor.h"

#include <gtest/gtest.h>
#include <sys/mount.h>
#include <sys/stat.h>

#include <fstream>
#include <memory>

#include "tests/conformance/temporary_directory.h"
#include "tests/conformance/test_store.h"

using namespace queue;
using namespace storage::files;
using namespace storage::sqlite;
using State = DiskSpace::State;

namespace {

constexpr std::uint64_t disk_bytes = 32u << 20;

class DiskSpaceMonitorTest : public testing::Test {
 protected:
  void SetUp() override {
    mounted = mount("whittle-test", directory.path().c_str(), "tmpfs", 0, "size=32m") == 0;
    if (!mounted) GTEST_SKIP() << "no tmpfs can be mounted here";
  }
  void TearDown() override {
    if (mounted) umount(directory.path().c_str());
  }
  std::string path(const std::string& name) const { return directory.path() + "/" + name; }
  /// Fills the disk except for this number of bytes and the needs of the file system.
  void fill_but(std::uint64_t bytes) {
    disk().measure();
    std::ofstream file(path("filler"), std::ios::binary | std::ios::app);
    const std::uint64_t free = disk().now().free_bytes;
    ASSERT_GT(free, bytes);
    file << std::string(free - bytes, 'x');
  }
  void make_room() { std::filesystem::remove(path("filler")); }
  DiskSpaceMonitor& disk() {
    if (!room) room = std::make_unique<DiskSpaceMonitor>(path("data"), DiskSpaceSettings{}, no_log());
    return *room;
  }
  std::uint64_t ballast() const {
    return std::filesystem::exists(path("data/ballast")) ? std::filesystem::file_size(path("data/ballast")) : 0;
  }

  TemporaryDirectory directory;
  std::unique_ptr<DiskSpaceMonitor> room;
  bool mounted = false;
};

}  // namespace

TEST_F(DiskSpaceMonitorTest, ReservesATenthOfASmallDisk) {
  EXPECT_EQ(disk().now().state, State::enough);
  EXPECT_EQ(disk().now().reserve_bytes, disk_bytes / 10);
  EXPECT_EQ(ballast(), disk_bytes / 32);
  struct stat status {};
  ASSERT_EQ(stat(path("data/ballast").c_str(), &status), 0);
  EXPECT_GE(static_cast<std::uint64_t>(status.st_blocks) * 512, disk_bytes / 32) << "it really takes room";
}

TEST_F(DiskSpaceMonitorTest, IsScarceBelowTheReserveAndKeepsTheBallast) {
  fill_but(disk_bytes / 20);
  EXPECT_FALSE(disk().measure());
  EXPECT_EQ(disk().now().state, State::scarce);
  EXPECT_EQ(ballast(), disk_bytes / 32);
  make_room();
  disk().measure();
  EXPECT_EQ(disk().now().state, State::enough);
}

TEST_F(DiskSpaceMonitorTest, DeletesTheBallastOnAFullDiskAndRestoresItWithSpace) {
  fill_but(0);
  EXPECT_FALSE(disk().measure());
  EXPECT_EQ(disk().now().state, State::none);
  EXPECT_EQ(ballast(), 0u);
  EXPECT_FALSE(disk().measure()) << "the deleted ballast does not count as free space";
  EXPECT_EQ(ballast(), 0u);
  make_room();
  EXPECT_TRUE(disk().measure());
  EXPECT_EQ(disk().now().state, State::enough);
  EXPECT_EQ(ballast(), disk_bytes / 32);
  EXPECT_FALSE(disk().measure());
}

TEST_F(DiskSpaceMonitorTest, DeletesTheBallastOfADeadDaemonSoThatTheStoreCanOpen) {
  disk();
  {
    TestStore store(path("data"));
    for (const char* id : {"cancelled", "removed", "succeeded"}) store.submit(job_named(id), "{}");
  }
  fill_but(0);
  room.reset();
  disk();
  EXPECT_EQ(ballast(), 0u);
  TestStore store(path("data"));
  EXPECT_EQ(store.cancel("cancelled", 1), CancelOutcome::cancelled);
  EXPECT_EQ(store.remove("removed").outcome, RemoveOutcome::removed);
  const Claim claim = store.claim("boot", 1, 2, false).value();
  EXPECT_TRUE(store.succeed(claim.job.id, claim.fence, 2, std::string(10'000, 'r'), {}));
}

TEST_F(DiskSpaceMonitorTest, ThrowsIfTheDiskCannotBeMeasured) {
  disk();
  std::filesystem::remove_all(path("data"));
  EXPECT_THROW(disk().measure(), StoreFailure);
}
