/// The stores on a disk whose sync fails: a write that could not be synced is rejected and not visible.

#include <gtest/gtest.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "server/queue/disk_health.h"
#include "server/queue/queue.h"
#include "server/storage/files/file_stores.h"
#include "server/storage/sqlite/sqlite_stores.h"
#include "tests/conformance/memory_file.h"
#include "tests/conformance/temporary_directory.h"
#include "tests/conformance/test_store.h"

using namespace queue;
using namespace storage::files;
using namespace storage::sqlite;

namespace {

std::atomic<bool> sync_fails = false;
std::atomic<int> sync_count = 0;

int sync_unless_failing(long call, int fd) {
  ++sync_count;
  if (sync_fails) {
    errno = EIO;
    return -1;
  }
  return static_cast<int>(syscall(call, fd));
}

/// Expects that the call reports the failure of its syncs.
void expect_sync_failure(const std::function<void()>& call) {
  sync_fails = true;
  EXPECT_THROW(call(), StoreFailure);
  sync_fails = false;
}

}  // namespace

// In place of libc's, for this program and the libraries in it.
extern "C" int fsync(int fd) { return sync_unless_failing(SYS_fsync, fd); }
extern "C" int fdatasync(int fd) { return sync_unless_failing(SYS_fdatasync, fd); }

TEST_F(SqliteStoresTest, SyncsBeforeItReturnsAndRejectsWritesAfterAFailedSync) {
  {
    TestStore store(directory.path());
    const int before = sync_count;
    store.submit(job_named("kept"), "kept");
    EXPECT_GT(sync_count, before);
    expect_sync_failure([&] { store.submit(job_named("refused"), "refused"); });
    EXPECT_FALSE(store.find("refused"));
    EXPECT_EQ(store.find("kept")->state, JobState::queued);
    const int syncs = sync_count;
    EXPECT_THROW(store.submit(job_named("later"), "later"), StoreFailure) << "a sync that failed once may lie";
    EXPECT_THROW(store.probe(), StoreFailure);
    EXPECT_THROW(store.claim("boot", 1, 9000, false), StoreFailure);
    EXPECT_EQ(sync_count, syncs);
  }
  TestStore store(directory.path());
  if (store.find("refused")) {
    EXPECT_EQ(store.document("refused"), "refused") << "rows on the disk are complete";
  }
  store.submit(job_named("later"), "later");
  EXPECT_EQ(store.claim("boot", 1, 9000, false)->job.id, "kept");
}

TEST_F(SqliteStoresTest, SyncsClaimsAndWritesThatAreNotDurableWithTheNextDurableWrite) {
  TestStore store(directory.path());
  store.submit(job_named("a"), "a");
  const int before = sync_count;
  const Claim first = store.claim("boot", 1, 9000, false).value();
  store.renew({{"a", first.fence}}, 10'000);
  store.insert({.jobs = {{job_named("b"), "b"}}, .durable = false}, 1);
  const Claim second = store.claim("boot", 1, 9000, false).value();
  EXPECT_TRUE(store.succeed("b", second.fence, 2, "{}", {}, false));
  EXPECT_EQ(sync_count, before);
  store.probe();
  const int probed = sync_count;
  EXPECT_GT(probed, before);
  EXPECT_TRUE(store.succeed("a", first.fence, 2, "{}", {}));
  EXPECT_GT(sync_count, probed);
}

TEST(SmallArtifactStore, SyncsSmallArtifactsWithTheNextDurableWriteOnly) {
  TemporaryStores synced{.settings = {}};
  const int before = sync_count;
  synced.artifacts.sync(synced.artifacts.put(MemoryFile("abc").fd()).sha256);
  EXPECT_EQ(sync_count, before);
  synced.store.probe();
  EXPECT_EQ(sync_count, before + 1);
  synced.artifacts.put(MemoryFile(std::string(100'000, 'x')).fd());
  EXPECT_EQ(sync_count, before + 3) << "file and directory";
}

TEST(Queue, SyncsNothingForJobsThatAreNotDurable) {
  TemporaryStores synced{.settings = {}};
  IdSource ids(system_clock(), system_random());
  Queue queue(synced.store.all(), synced.artifacts, ids, system_clock(), no_log(), {});
  const MemoryFile small("abc"), large(std::string(100'000, 'x'));
  const int before = sync_count;
  for (int i = 0; i < 20; ++i) {  // fewer than fill the log, whose checkpoint syncs
    ASSERT_TRUE(queue.submission.submit({.document = "{}", .durable = false}));
    const Claim claim = queue.lifecycle.claim().value();
    ASSERT_TRUE(
        queue.lifecycle.succeed(claim.job.id, claim.fence, "{}",
                                {{"image.png", "image/png", small.fd()}, {"image.exr", "image/x-exr", large.fd()}}));
  }
  EXPECT_EQ(sync_count, before);
}

TEST_F(FileArtifactStoreTest, SyncsArtifactsThatAreNotDurableOnlyOnRequest) {
  FileArtifactStore store(directory.path());
  const int before = sync_count;
  const std::string first = store.put(MemoryFile("abc").fd(), false).sha256;
  store.put(MemoryFile("def").fd(), false);
  EXPECT_EQ(sync_count, before);
  store.sync(first);
  EXPECT_EQ(sync_count, before + 2) << "file and directory";
  store.put(MemoryFile("def").fd());
  EXPECT_EQ(sync_count, before + 4) << "of the existing file";
}

TEST(DiskHealth, ReportsTheFirstBrokenWriteOnceAndRejectsLaterOnes) {
  const TemporaryDirectory directory;
  std::vector<std::string> reported;
  DiskHealth health([&](const std::string& what) { reported.push_back(what); });
  TestStore jobs(directory.path(), {.health = &health});
  FileArtifactStore artifacts(directory.path(), &health);
  FileAssetStore uploads(
      directory.path() + "/uploads", [] { return 1; }, UINT64_MAX, &health);
  const std::string kept = artifacts.put(MemoryFile("abc").fd()).sha256;
  expect_sync_failure([&] { artifacts.put(MemoryFile("def").fd()); });
  ASSERT_EQ(reported.size(), 1u);
  EXPECT_NE(reported[0].find("cannot sync"), std::string::npos) << reported[0];
  const int syncs = sync_count;
  for (const auto& write : std::vector<std::function<void()>>{
           [&] { jobs.submit(job_named("a"), "a"); },
           [&] {
             jobs.sqlite().deliveries().subscribe({"a", "http://a/", {"failed"}});
           },
           [&] { artifacts.put(MemoryFile("def").fd()); },
           [&] { uploads.put(kept, [](std::uint64_t, char*, std::size_t) -> std::size_t { return 0; }); }}) {
    EXPECT_EQ(failure_of(write).kind, StoreFailure::Kind::broken);
  }
  EXPECT_EQ(sync_count, syncs);
  EXPECT_EQ(reported.size(), 1u);
  EXPECT_NE(artifacts.open(kept), nullptr) << "reads still work";
  EXPECT_FALSE(jobs.find("a"));
}

TEST(SqliteDeliveryStore, ReportsAFailedSyncAndRejectsLaterWrites) {
  const TemporaryDirectory directory;
  int reported = 0;
  DiskHealth health([&](const std::string&) { ++reported; });
  {
    const SqliteStores stores(directory.path(), {.health = &health});
    DeliveryStore& store = stores.deliveries();
    store.subscribe({"kept", "http://a/", {"failed"}});
    expect_sync_failure([&] { store.subscribe({"refused", "http://a/", {"failed"}}); });
    EXPECT_EQ(reported, 1);
    const int syncs = sync_count;
    EXPECT_THROW(store.unsubscribe("kept"), StoreFailure);
    EXPECT_EQ(sync_count, syncs);
  }
  const SqliteStores stores(directory.path());
  EXPECT_TRUE(stores.deliveries().subscription("kept"));
}

TEST_F(FileArtifactStoreTest, SyncsFileAndDirectoryAndKeepsNothingAfterAFailedSync) {
  FileArtifactStore first(directory.path());
  const int before = sync_count;
  const std::string sha256 = first.put(MemoryFile("abc").fd()).sha256;
  EXPECT_GE(sync_count, before + 2);
  first.remove(sha256);
  expect_sync_failure([&] { first.put(MemoryFile("abc").fd()); });
  FileArtifactStore store(directory.path());
  EXPECT_EQ(store.open(sha256), nullptr);
  EXPECT_TRUE(std::filesystem::is_empty(directory.path() + "/tmp"));
  EXPECT_EQ(store.put(MemoryFile("abc").fd()).sha256, sha256);
  EXPECT_NE(store.open(sha256), nullptr);
}

TEST_F(FileAssetStoreTest, SyncsFileAndDirectoryAndKeepsNothingAfterAFailedSync) {
  FileAssetStore first(directory.path(), [] { return 1; });
  const std::string sha256 = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad",
                    bytes = "abc";  // FIPS 180-4
  expect_sync_failure([&] { first.put(sha256, reading(bytes)); });
  FileAssetStore store(directory.path(), [] { return 1; });
  EXPECT_FALSE(store.use(sha256));
  EXPECT_TRUE(std::filesystem::is_empty(directory.path() + "/tmp"));
  const int before = sync_count;
  EXPECT_EQ(store.put(sha256, reading(bytes)), AssetStore::Put::stored);
  EXPECT_GE(sync_count, before + 2);
}
