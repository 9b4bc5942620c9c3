/// Stores that several nodes share: what one node removes while another one needs it, damage, and what is collected;
/// and the cache of a node.

#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "server/storage/objects/asset_cache.h"
#include "tests/conformance/bucket_under_test.h"
#include "tests/conformance/memory_file.h"
#include "tests/conformance/test_store.h"
#include "tracer/sha256.h"

using namespace queue;
using namespace storage::objects;
namespace fs = std::filesystem;

namespace {

constexpr std::int64_t day = 24 * 3600 * 1000;

/// A node: its own connections to one database and one directory.
struct Node : SharedNode<SharedArtifactStore> {
  Node(const std::string& database, const std::string& directory, const std::atomic<std::int64_t>& now)
      : SharedNode(database, objects_in_directory(directory), [&now] { return now.load(); }) {}
  std::string put(const std::string& bytes) { return store.put(MemoryFile(bytes).fd()).sha256; }
};

class SharedStores : public testing::Test {
 protected:
  /// Stores a succeeded job that names an artifact.
  void name_in_a_job(const std::string& sha256) {
    Job job = job_named(sha256);
    job.state = JobState::succeeded;
    job.started_at = job.ended_at = now;
    job.artifacts = {{"image.png", "image/png", sha256, 3}};
    StoreCalls(a.rows.all()).submit(job, "{}");
  }

  int collect_all(SharedArtifactStore& store) {
    int removed = 0;
    for (int part = 0; part < AssetStore::parts; ++part) removed += store.collect(part);
    return removed;
  }

  const TemporaryDirectory directory;
  const std::string database = PostgresServer::shared().new_database();
  std::atomic<std::int64_t> now = 1'700'000'000'000;
  const std::string objects = directory.path() + "/objects";
  Node a{database, objects, now}, b{database, objects, now};
};

}  // namespace

TEST_F(SharedStores, ANodeFindsWhatAnotherOneHasStored) { EXPECT_EQ(bytes_of(b.store.open(a.put("abc"))), "abc"); }

TEST_F(SharedStores, KeepsWhatWasStoredOrKeptWithinADay) {
  const std::string sha256 = a.put("abc");
  now += day - 1;
  b.store.remove(sha256);
  EXPECT_NE(a.store.open(sha256), nullptr) << "a job may be about to name it";
  a.store.keep(sha256);
  now += day;
  b.store.remove(sha256);
  EXPECT_NE(a.store.open(sha256), nullptr);
  now += 1;
  b.store.remove(sha256);
  EXPECT_EQ(a.store.open(sha256), nullptr);
}

TEST_F(SharedStores, NeverRemovesWhatAJobNames) {
  const std::string sha256 = a.put("abc");
  name_in_a_job(sha256);
  now += 2 * day;
  b.store.remove(sha256);
  EXPECT_EQ(collect_all(b.store), 0);
  EXPECT_NE(a.store.open(sha256), nullptr);
}

TEST_F(SharedStores, CollectsWhatNoJobNamesAfterADay) {
  const std::string named = a.put("named"), unnamed = a.put("unnamed");
  name_in_a_job(named);
  now += day;
  EXPECT_EQ(collect_all(b.store), 0);
  now += 1;
  EXPECT_EQ(collect_all(b.store), 1);
  EXPECT_EQ(a.store.open(unnamed), nullptr);
  EXPECT_NE(a.store.open(named), nullptr);
}

TEST_F(SharedStores, AnArtifactThatIsStoredWhileAnotherNodeRemovesItExistsAfterwards) {
  const std::string bytes = "abc", sha256 = a.put(bytes);
  const std::jthread remover([&](const std::stop_token& stop) {
    while (!stop.stop_requested()) {
      b.index.remove_unused_since(sha256, now - 1000, [&] { b.objects->remove(sha256); });
    }
  });
  for (int i = 0; i < 100; ++i) {
    now += 10'000;  // what was stored before may be removed
    a.put(bytes);
    EXPECT_NE(a.store.open(sha256), nullptr) << i;
  }
}

TEST_F(SharedStores, CollectsObjectsThatTheDatabaseDoesNotHave) {
  const std::string bytes = "lost", sha256 = tracer::sha256_hex(bytes);
  a.objects->put(sha256, bytes.size(), reading(bytes));
  const std::string known = a.put("known");
  name_in_a_job(known);
  std::string after;
  int calls = 0;
  do {
    after = adopt_objects(*a.objects, a.index, after, now);
    ++calls;
  } while (!after.empty());
  EXPECT_EQ(calls, 3) << "two parts and the end";
  EXPECT_EQ(collect_all(b.store), 0) << "its put may be in progress";
  now += day + 1;
  EXPECT_EQ(collect_all(b.store), 1);
  EXPECT_EQ(a.store.open(sha256), nullptr);
  EXPECT_NE(a.store.open(known), nullptr);
}

TEST_F(SharedStores, FindsAndReplacesChangedBytes) {
  for (const std::string& bytes : {std::string("abc"), std::string(1'000'000, 'x')}) {
    const std::string sha256 = a.put(bytes);
    const std::string path = objects + "/" + asset_path(sha256);
    std::string changed = bytes;
    changed.back() = '!';
    std::ofstream(path, std::ios::binary) << changed;
    if (bytes.size() > small_bytes) {
      const auto reader = b.store.open(sha256);
      ASSERT_NE(reader, nullptr);
      std::string begin(1000, '?');
      EXPECT_EQ(reader->read(0, begin.data(), begin.size()), begin.size()) << "the whole is not known yet";
      for (int i = 0; i < 2; ++i)
        EXPECT_EQ(failure_of([&] { bytes_of(reader); }).kind, StoreFailure::Kind::damaged) << "at the last bytes";
    }
    EXPECT_EQ(b.store.open(sha256), nullptr);
    EXPECT_NE(b.store.open(sha256, /*verified=*/false), nullptr);
    a.put(bytes);
    b.put(bytes);
    EXPECT_TRUE(bytes_of(b.store.open(sha256)) == bytes);
  }
}

TEST_F(SharedStores, LeaveUnfinishedFilesOfOtherNodesForADay) {
  const std::string young = objects + "/tmp/other-1", old = objects + "/tmp/other-2";
  std::ofstream(young) << "half";
  std::ofstream(old) << "half";
  fs::last_write_time(old, fs::file_time_type::clock::now() - std::chrono::hours(25));
  objects_in_directory(objects)->remove_unfinished();
  EXPECT_TRUE(fs::exists(young));
  EXPECT_FALSE(fs::exists(old));
}

TEST(BucketObjects, ListsItsObjectsAndNothingElse) {
  BucketUnderTest artifacts("artifacts");
  std::vector<std::string> names;
  for (int i = 0; i < 5; ++i) {
    const std::string bytes = std::to_string(i);
    names.push_back(tracer::sha256_hex(bytes));
    artifacts.put(names.back(), 1, reading(bytes));
  }
  std::sort(names.begin(), names.end());
  std::vector<std::string> found;
  for (const auto& object : artifacts.list("")) found.push_back(object.sha256);
  EXPECT_EQ(found, names);
  EXPECT_EQ(artifacts.list(names[2]).size(), 2u);
  EXPECT_TRUE(artifacts.list(names[4]).empty());
}

TEST(BucketObjects, DeletesUploadsThatAKilledNodeHasLeft) {
  BucketUnderTest assets("assets");
  S3Server::shared().command("begin " + assets.prefix() + "assets/ab/x");
  S3Server::shared().command("age");
  S3Server::shared().command("begin " + assets.prefix() + "assets/ab/y");
  const int before = std::stoi(S3Server::shared().command("uploads"));
  assets.remove_unfinished();
  EXPECT_EQ(std::stoi(S3Server::shared().command("uploads")), before - 1);
}

TEST(BucketObjects, VerifiesLargeObjectsWhileTheyAreRead) {
  auto bucket = std::make_unique<BucketUnderTest>("artifacts");
  const std::string prefix = bucket->prefix() + "artifacts/";
  const auto store = make_shared_store<SharedArtifactStore>(std::move(bucket), [] { return 1; });
  const std::string bytes(3'000'000, 'y'), sha256 = store->put(MemoryFile(bytes).fd()).sha256;
  EXPECT_TRUE(bytes_of(store->open(sha256)) == bytes);
  S3Server::shared().command("corrupt " + prefix + asset_path(sha256));
  const auto reader = store->open(sha256);
  EXPECT_THROW(bytes_of(reader), StoreFailure);
  EXPECT_EQ(store->open(sha256), nullptr);
  store->put(MemoryFile(bytes).fd());
  EXPECT_TRUE(bytes_of(store->open(sha256)) == bytes);
}

namespace {

/// Assets whose bytes are a repeated letter; counts the fetches.
class LetterAssets final : public AssetStore {
 public:
  Put put(const std::string&, const Read&) override { return Put::quota_exceeded; }
  std::uint64_t bytes() override { return 0; }
  bool use(const std::string&) override { return true; }
  std::vector<std::string> unused_since(int, std::int64_t) override { return {}; }
  bool remove_unused_since(const std::string&, std::int64_t) override { return false; }
  std::unique_ptr<ArtifactReader> open(const std::string& sha256) override {
    ++fetches;
    for (const char letter : std::string("abcdefgh")) {
      const std::string bytes(100, letter);
      if (tracer::sha256_hex(bytes) == sha256) return std::make_unique<MemoryReader>(damaged ? "damaged" : bytes);
    }
    return nullptr;
  }
  std::atomic<int> fetches = 0;
  bool damaged = false;
};

class AssetCacheTest : public DirectoryTest {
 protected:
  LetterAssets assets;
};

std::string name_of(char letter) { return tracer::sha256_hex(std::string(100, letter)); }

std::string content(const support::Descriptor& file) {
  std::string bytes(1000, '?');
  const ssize_t size = file ? pread(file.get(), bytes.data(), bytes.size(), 0) : -1;
  bytes.resize(size < 0 ? 0 : static_cast<std::size_t>(size));
  return bytes;
}

}  // namespace

TEST_F(AssetCacheTest, FetchesOnceAndSurvivesARestart) {
  for (int i = 0; i < 2; ++i) {
    AssetCache cache(directory.path(), 1000, assets);
    EXPECT_EQ(content(cache.open(name_of('a'))), std::string(100, 'a'));
    EXPECT_EQ(content(cache.open(name_of('a'))), std::string(100, 'a'));
  }
  EXPECT_EQ(assets.fetches, 1);
}

TEST_F(AssetCacheTest, DeletesTheLeastRecentlyUsedFilesAndNotThoseThatAreOpen) {
  AssetCache cache(directory.path(), 350, assets);
  const support::Descriptor b = cache.open(name_of('b'));
  for (const char letter : {'a', 'c'}) cache.open(name_of(letter));
  const auto hour_ago = fs::file_time_type::clock::now() - std::chrono::hours(1);
  for (const char letter : {'b', 'c'})
    fs::last_write_time(directory.path() + "/" + asset_path(name_of(letter)), hour_ago);
  cache.open(name_of('d'));
  EXPECT_LE(bytes_in(directory.path()), 350u);
  EXPECT_EQ(content(b), std::string(100, 'b'));
  cache.open(name_of('a'));
  EXPECT_EQ(assets.fetches, 4) << "a was used last, and stays";
}

TEST_F(AssetCacheTest, KeepsNothingOfDamagedAndMissingAssets) {
  AssetCache cache(directory.path(), 1000, assets);
  for (const std::string& name : {std::string("../../etc/passwd"), std::string(64, '0'), std::string()})
    EXPECT_FALSE(cache.open(name)) << name;
  assets.damaged = true;
  EXPECT_THROW((void)cache.open(name_of('a')), StoreFailure);
  EXPECT_EQ(bytes_in(directory.path()), 0u);
  assets.damaged = false;
  EXPECT_EQ(content(cache.open(name_of('a'))), std::string(100, 'a'));
}
