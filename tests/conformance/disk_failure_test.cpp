/// The stores on a full disk: no partial writes, no loss of acknowledged data, recovery with free space.

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <thread>
#include <vector>

#include "server/storage/files/directory_lock.h"
#include "server/storage/files/file_stores.h"
#include "server/support/read_file.h"
#include "tests/conformance/memory_file.h"
#include "tests/conformance/temporary_directory.h"
#include "tests/conformance/test_store.h"
#include "tracer/sha256.h"

using namespace queue;
using namespace storage::files;
using namespace storage::sqlite;

namespace {

/// Simulates a full disk: while this exists, no file of this process can grow beyond `bytes`.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) {
    getrlimit(RLIMIT_FSIZE, &before_);
    before_handler_ = std::signal(SIGXFSZ, SIG_IGN);  // else the kernel ends us instead of returning EFBIG
    const rlimit limit{bytes, before_.rlim_max};
    setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FileSizeLimit() {
    setrlimit(RLIMIT_FSIZE, &before_);
    std::signal(SIGXFSZ, before_handler_);
  }
  FileSizeLimit(const FileSizeLimit&) = delete;
  FileSizeLimit& operator=(const FileSizeLimit&) = delete;

 private:
  rlimit before_{};
  void (*before_handler_)(int) = nullptr;
};

}  // namespace

TEST_F(SqliteStoresTest, StoresNothingOnAFullDiskAndRecoversWithSpace) {
  TestStore store(directory.path());
  store.submit(job_named("before"), "before");
  {
    const FileSizeLimit full(1 << 20);
    EXPECT_EQ(failure_of([&] { store.submit(job_named("large"), std::string(4 << 20, 'x')); }).kind,
              StoreFailure::Kind::full);
    EXPECT_FALSE(store.find("large"));
    EXPECT_TRUE(store.find("before"));
  }
  store.submit(job_named("large"), std::string(4 << 20, 'x'));
  EXPECT_EQ(store.document("before"), "before");
  EXPECT_EQ(store.count(JobState::queued), 2);
}

TEST_F(SqliteStoresTest, KeepsAcknowledgedJobsWhileTheDiskFills) {
  std::vector<std::string> acknowledged;
  int refused = 0;
  {
    TestStore store(directory.path());
    const FileSizeLimit full(3 << 20);
    for (int i = 0; i < 100; ++i) {
      const std::string id = "job-" + std::to_string(i);
      const auto failure = failure_of([&] { store.submit(job_named(id), std::string(100'000, 'x')); }).kind;
      if (!failure) acknowledged.push_back(id);
      if (failure) ++refused;
    }
  }
  EXPECT_GT(acknowledged.size(), 0u);
  EXPECT_GT(refused, 0);
  TestStore store(directory.path());
  for (const std::string& id : acknowledged) EXPECT_TRUE(store.find(id)) << id;
  EXPECT_EQ(store.count(JobState::queued), static_cast<std::int64_t>(acknowledged.size()));
}

TEST_F(SqliteStoresTest, KeepsOtherWritesOfAGroupWhenOneDoesNotFit) {
  TestStore store(directory.path());
  for (int i = 0; i < 20; ++i) store.submit(job_named("warm-" + std::to_string(i)), "{}");
  const FileSizeLimit full(8 << 20);
  in_threads(8, [&](int thread) {
    for (int i = 0; i < 10; ++i) {
      const std::string id = std::to_string(thread) + "-" + std::to_string(i);
      const bool large = thread == 0;
      const Failure failure = failure_of([&] { store.submit(job_named(id), std::string(large ? 10 << 20 : 10, 'x')); });
      EXPECT_EQ(failure.kind.has_value(), large) << id << ": " << failure.what;
    }
  });
}

TEST_F(FileArtifactStoreTest, StoresNothingOnAFullDiskAndRecoversWithSpace) {
  FileArtifactStore store(directory.path());
  const MemoryFile image(std::string(1 << 20, 'x'));
  {
    const FileSizeLimit full(1 << 19);
    EXPECT_EQ(failure_of([&] { store.put(image.fd()); }).kind, StoreFailure::Kind::full);
  }
  EXPECT_NE(store.open(store.put(image.fd()).sha256), nullptr);
  EXPECT_TRUE(std::filesystem::is_empty(directory.path() + "/tmp"));
}

TEST_F(FileAssetStoreTest, StoresNothingOnAFullDiskAndRecoversWithSpace) {
  FileAssetStore store(directory.path(), [] { return 1; });
  const std::string bytes(1 << 20, 'x');
  const std::string sha256 = tracer::sha256_hex(bytes);
  {
    const FileSizeLimit full(1 << 19);
    EXPECT_EQ(failure_of([&] { store.put(sha256, reading(bytes)); }).kind, StoreFailure::Kind::full);
  }
  EXPECT_FALSE(store.use(sha256));
  EXPECT_EQ(store.put(sha256, reading(bytes)), AssetStore::Put::stored);
  EXPECT_TRUE(std::filesystem::is_empty(directory.path() + "/tmp"));
}

TEST_F(SqliteStoresTest, RejectsADirectoryThatIsInUse) {
  const TestStore first(directory.path());
  const Failure failure = failure_of([&] { TestStore second(directory.path()); });
  EXPECT_EQ(failure.kind, StoreFailure::Kind::unavailable);
  EXPECT_NE(failure.what.find(directory.path()), std::string::npos) << failure.what;
  EXPECT_NE(failure.what.find("in use by process " + std::to_string(getpid())), std::string::npos) << failure.what;
}

TEST(DirectoryLock, WaitsForADirectoryThatIsReleasedSoon) {
  const TemporaryDirectory directory;
  auto first = std::make_unique<DirectoryLock>(directory.path());
  int waits = 0;
  const auto release_at_last = [&] {
    if (++waits == DirectoryLock::retries) first.reset();
  };
  EXPECT_NO_THROW(DirectoryLock(directory.path(), release_at_last));
  EXPECT_EQ(waits, DirectoryLock::retries);
}

TEST_F(SqliteStoresTest, RejectsAFileWithAnotherSchemaAndLeavesItUnchanged) {
  for (const auto& [version, program] : {std::pair('\x63', "newer program"), std::pair('\x06', "older program")}) {
    const TemporaryDirectory fresh;
    const std::string path = fresh.path() + "/whittle.db";
    { const TestStore store(fresh.path()); }
    {
      // Byte 60..63 of the header is user_version, big-endian (SQLite file format, section 1.3).
      std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
      file.seekp(63);
      file.put(version);
    }
    const std::string what = failure_of([&] { TestStore store(fresh.path()); }).what;
    for (const std::string& part : {std::string(program), "version " + std::to_string(version), path})
      EXPECT_NE(what.find(part), std::string::npos) << part << " is not in: " << what;
  }
}

TEST_F(SqliteStoresTest, RejectsADatabaseOfAnotherProgramAndLeavesItUnchanged) {
  const std::string path = directory.path() + "/whittle.db";
  { const TestStore store(directory.path()); }
  {
    // SQLite file format, section 1.3: byte 18 and 19 are 1 without WAL, 68..71 is application_id.
    std::fstream file(path, std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(18).write("\1\1", 2);
    file.seekp(71).put('?');
  }
  const std::string before = support::read_file(path);
  EXPECT_EQ(failure_of([&] { TestStore store(directory.path()); }).kind, StoreFailure::Kind::unavailable);
  EXPECT_TRUE(support::read_file(path) == before);
  EXPECT_FALSE(std::filesystem::exists(path + "-wal"));
}

TEST_F(SqliteStoresTest, RejectsAnEmptiedDatabaseBesideImages) {
  const std::string path = directory.path() + "/whittle.db", sha256(64, 'a');
  { const TestStore store(directory.path()); }
  std::filesystem::create_directories(directory.path() + "/aa");
  std::ofstream(directory.path() + "/aa/" + sha256) << "image";
  EXPECT_NO_THROW(TestStore(directory.path())) << "with its database";
  for (const bool deleted : {false, true}) {
    std::filesystem::resize_file(path, 0);
    if (deleted) std::filesystem::remove(path);
    EXPECT_EQ(failure_of([&] { check_files(directory.path()); }).kind, StoreFailure::Kind::unavailable);
    EXPECT_EQ(failure_of([&] { TestStore store(directory.path()); }).kind, StoreFailure::Kind::unavailable) << deleted;
  }
  std::filesystem::remove(directory.path() + "/aa/" + sha256);
  EXPECT_NO_THROW(storage::sqlite::check_files(directory.path()));
  EXPECT_NO_THROW(TestStore(directory.path()));
}

TEST_F(SqliteStoresTest, RejectsAFileThatIsNoDatabase) {
  std::ofstream(directory.path() + "/whittle.db") << std::string(8192, 'x');
  EXPECT_EQ(failure_of([&] { TestStore store(directory.path()); }).kind, StoreFailure::Kind::unavailable);
}

TEST_F(SqliteStoresTest, BoundsTheLogUnderSteadyReading) {
  TestStore store(directory.path());
  std::vector<std::jthread> readers;
  for (int thread = 0; thread < 4; ++thread) {
    readers.emplace_back([&](const std::stop_token& stop) {
      while (!stop.stop_requested()) store.list({.state = {}, .labels = {}, .batch = {}, .text = "nothing"}, "", 50);
    });
  }
  std::uintmax_t largest = 0;
  for (int i = 0; i < 250; ++i) {
    store.submit(job_named("job-" + std::to_string(i)), std::string(500'000, 'x'));
    largest = std::max(largest, std::filesystem::file_size(directory.path() + "/whittle.db-wal"));
  }
  EXPECT_LT(largest, 64u << 20) << "of 125 MB written";
}
