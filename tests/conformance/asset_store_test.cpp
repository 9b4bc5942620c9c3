/// The contract of an asset store, run against every implementation, and the collector of unused assets.

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <stdexcept>
#include <thread>
#include <vector>

#include "server/queue/queue_maintainer.h"
#include "tests/conformance/bucket_under_test.h"
#include "tests/conformance/test_store.h"
#include "tests/support/threads.h"
#include "tracer/sha256.h"

using namespace queue;
using namespace storage::files;
using storage::objects::SharedAssetStore;
using Put = AssetStore::Put;

namespace {

struct AssetStoreKind {
  std::string name;
  std::function<std::shared_ptr<AssetStore>(const std::string& directory, const Clock& clock)> make;
};

std::shared_ptr<AssetStore> make_asset_files(const std::string& directory, const Clock& clock) {
  return std::make_shared<FileAssetStore>(directory, clock);
}

std::shared_ptr<AssetStore> make_shared_asset_directory(const std::string& directory, const Clock& clock) {
  return make_shared_store<SharedAssetStore>(storage::objects::objects_in_directory(directory), clock);
}

std::shared_ptr<AssetStore> make_asset_bucket(const std::string& /*directory*/, const Clock& clock) {
  return make_shared_store<SharedAssetStore>(std::make_unique<BucketUnderTest>("assets"), clock);
}

class AssetStoreConformance : public testing::TestWithParam<AssetStoreKind> {
 protected:
  AssetStore& store() { return *store_; }
  Put put(const std::string& bytes) { return store().put(tracer::sha256_hex(bytes), reading(bytes)); }
  std::string stored(const std::string& bytes) {
    put(bytes);
    return tracer::sha256_hex(bytes);
  }
  std::optional<std::string> get(const std::string& sha256) { return bytes_of(store().open(sha256)); }
  std::vector<std::string> all_unused_since(std::int64_t then) {
    std::vector<std::string> all;
    for (int part = 0; part < AssetStore::parts; ++part) {
      for (std::string& name : store().unused_since(part, then)) all.push_back(std::move(name));
    }
    std::sort(all.begin(), all.end());
    return all;
  }
  [[nodiscard]] const std::string& directory() const { return directory_.path(); }

  std::atomic<std::int64_t> now = 1'700'000'000'123;

 private:
  TemporaryDirectory directory_;
  std::shared_ptr<AssetStore> store_ = GetParam().make(directory_.path() + "/uploads", [this] { return now.load(); });
};

/// The part of the assets that the collector visits with this one.
int part_of(const std::string& sha256) { return std::stoi(sha256.substr(0, 2), nullptr, 16); }

}  // namespace

TEST_P(AssetStoreConformance, ReturnsTheBytesThatWerePut) {
  for (const std::string& bytes : {std::string(), std::string("abc"), std::string(1 << 18, 'x'), large_bytes()}) {
    EXPECT_EQ(put(bytes), Put::stored);
    EXPECT_EQ(get(tracer::sha256_hex(bytes)), bytes) << bytes.size() << " bytes";
    EXPECT_TRUE(store().use(tracer::sha256_hex(bytes)));
  }
}

TEST_P(AssetStoreConformance, IsEmptyAtFirst) {
  const std::string name = tracer::sha256_hex("abc");
  EXPECT_FALSE(store().use(name));
  EXPECT_EQ(get(name), std::nullopt);
  EXPECT_FALSE(store().remove_unused_since(name, now + 1));
}

TEST_P(AssetStoreConformance, RejectsBytesThatDoNotMatchTheName) {
  const std::string name = tracer::sha256_hex("abc"), other = "abd";
  EXPECT_EQ(store().put(name, reading(other)), Put::other_bytes);
  EXPECT_EQ(get(name), std::nullopt);
  EXPECT_EQ(get(tracer::sha256_hex(other)), std::nullopt);
  put("abc");
  EXPECT_EQ(store().put(name, reading(other)), Put::other_bytes);
  EXPECT_EQ(get(name), "abc");
}

TEST_P(AssetStoreConformance, ReportsBytesThatExist) {
  EXPECT_EQ(put("abc"), Put::stored);
  EXPECT_EQ(put("abc"), Put::was_there);
  EXPECT_EQ(get(tracer::sha256_hex("abc")), "abc");
}

TEST_P(AssetStoreConformance, FindsNothingUnderOtherNames) {
  const std::string sha256 = stored("abc"), bytes = "abc";
  std::string upper = sha256;
  for (char& c : upper) c = static_cast<char>(std::toupper(c));
  for (const std::string& name : {std::string(), std::string("../../etc/passwd"), sha256.substr(1), sha256 + "0", upper,
                                  std::string(64, '/'), std::string(63, 'a') + "\n"}) {
    EXPECT_EQ(store().put(name, reading(bytes)), Put::other_bytes) << name;
    EXPECT_FALSE(store().use(name)) << name;
    EXPECT_EQ(store().open(name), nullptr) << name;
    EXPECT_FALSE(store().remove_unused_since(name, now + 1)) << name;
  }
  EXPECT_EQ(get(sha256), "abc");
}

TEST_P(AssetStoreConformance, StoresNothingOfAnInterruptedUpload) {
  const std::string bytes = large_bytes();
  const auto breaks_off = [&](std::uint64_t offset, char* into, std::size_t size) {
    if (offset > 500'000) throw std::runtime_error("gone");
    return bytes.copy(into, size, offset);
  };
  EXPECT_THROW(store().put(tracer::sha256_hex(bytes), breaks_off), std::runtime_error);
  EXPECT_EQ(get(tracer::sha256_hex(bytes)), std::nullopt);
  EXPECT_EQ(put(bytes), Put::stored);
}

TEST_P(AssetStoreConformance, ListsTheAssetsThatWereNotUsedSinceATime) {
  const std::string early = stored("early"), late = stored("late");
  now += 1000;
  EXPECT_TRUE(store().use(late));
  EXPECT_EQ(all_unused_since(now - 1000), std::vector<std::string>{});
  EXPECT_EQ(all_unused_since(now - 999), std::vector<std::string>{early});
  EXPECT_EQ(all_unused_since(now), std::vector<std::string>{early});
  EXPECT_EQ(all_unused_since(now + 1).size(), 2u);
}

TEST_P(AssetStoreConformance, PutMarksAnAssetAsUsedAndOpenDoesNot) {
  const std::string again = stored("again"), opened = stored("opened");
  now += 1000;
  put("again");
  get(opened);
  EXPECT_EQ(all_unused_since(now), std::vector<std::string>{opened});
}

TEST_P(AssetStoreConformance, DoesNotRemoveAnAssetThatWasUsedMeanwhile) {
  const std::string sha256 = stored("abc");
  now += 1000;
  ASSERT_EQ(all_unused_since(now), std::vector<std::string>{sha256});
  store().use(sha256);
  EXPECT_FALSE(store().remove_unused_since(sha256, now));
  EXPECT_EQ(get(sha256), "abc");
  EXPECT_TRUE(store().remove_unused_since(sha256, now + 1));
  EXPECT_FALSE(store().use(sha256));
}

TEST_P(AssetStoreConformance, AnOpenReaderOutlivesTheRemoval) {
  const std::string sha256 = stored("abc");
  const std::unique_ptr<ArtifactReader> reader = store().open(sha256);
  EXPECT_TRUE(store().remove_unused_since(sha256, now + 1));
  EXPECT_EQ(bytes_of(reader), "abc");
}

TEST_P(AssetStoreConformance, CollectorDeletesOldAssetsThatNoJobNames) {
  TemporaryStores jobs;
  const std::string named = stored("named"), forgotten = stored("forgotten");
  now += 1000;
  const std::string young = stored("young");
  Job job = job_named("job");
  job.assets = {named};
  jobs.store.submit(job, "{}");
  int removed = 0;
  for (int part = 0; part < AssetStore::parts; ++part)
    removed += collect_assets(store(), jobs.store.all().maintenance, part, now);
  EXPECT_EQ(removed, 1);
  EXPECT_EQ(get(forgotten), std::nullopt);
  EXPECT_EQ(get(named), "named");
  EXPECT_EQ(get(young), "young");
  jobs.store.remove("job");
  EXPECT_EQ(collect_assets(store(), jobs.store.all().maintenance, part_of(named), now), 1);
}

TEST_P(AssetStoreConformance, CollectorKeepsTheAssetsOfJobsStoredMeanwhile) {
  // A thread that finds the asset stores a job that names it; everything is old at once, and collected again
  // and again.
  TemporaryStores jobs;
  const std::string bytes = "shared", sha256 = tracer::sha256_hex(bytes);
  const std::jthread collector([&](const std::stop_token& stop) {
    while (!stop.stop_requested())
      collect_assets(store(), jobs.store.all().maintenance, part_of(sha256), now - 100'000);
  });
  for (int round = 0; round < 300; ++round) {
    now += 1'000'000;  // assets used in the previous round are old
    store().put(sha256, reading(bytes));
    now += 1'000'000;
    if (!store().use(sha256)) continue;  // collected before: then the job is refused
    Job job = job_named("job " + std::to_string(round));
    job.assets = {sha256};
    jobs.store.submit(job, "{}");
    now += 1'000'000;
    std::this_thread::yield();
    EXPECT_EQ(get(sha256), bytes) << "of an accepted job, round " << round;
    jobs.store.remove(job.id);
  }
}

TEST_P(AssetStoreConformance, StoresConcurrentPutsOfEqualBytesOnce) {
  in_threads(8, [&](int) {
    for (int i = 0; i < 10; ++i) EXPECT_NE(put("shared " + std::to_string(i)), Put::other_bytes);
  });
  EXPECT_EQ(all_unused_since(now + 1).size(), 10u);
}

INSTANTIATE_TEST_SUITE_P(Stores, AssetStoreConformance,
                         testing::Values(AssetStoreKind{"Files", make_asset_files},
                                         AssetStoreKind{"SharedDirectory", make_shared_asset_directory},
                                         AssetStoreKind{"S3", make_asset_bucket}),
                         [](const auto& kind) { return kind.param.name; });

TEST_F(FileAssetStoreTest, KeepsAssetsAndTheirLastUseOverARestartAndDeletesIncompleteFiles) {
  const std::string uploads = directory.path() + "/uploads", bytes = "abc", sha256 = tracer::sha256_hex(bytes);
  ASSERT_EQ(FileAssetStore(uploads, [] { return 5'000; }).put(sha256, reading(bytes)), Put::stored);
  std::ofstream(uploads + "/tmp/17") << "half";
  FileAssetStore store(uploads, [] { return 9'000; });
  EXPECT_EQ(store.unused_since(part_of(sha256), 5'000), std::vector<std::string>{});
  EXPECT_EQ(store.unused_since(part_of(sha256), 5'001), std::vector<std::string>{sha256});
  EXPECT_TRUE(std::filesystem::is_empty(uploads + "/tmp"));
  EXPECT_TRUE(std::filesystem::exists(uploads + "/" + asset_path(sha256)));
}

TEST_F(FileAssetStoreTest, KeepsALastUseThatIsMoreThan63BitsOfNanosecondsAfter1970) {
  constexpr std::int64_t year_2020 = 1'577'836'800'000, year_2400 = 13'569'465'600'000;
  const TemporaryDirectory directory;
  FileAssetStore store(directory.path(), [] { return year_2400; });
  const std::string sha256 = tracer::sha256_hex("abc");
  ASSERT_EQ(store.put(sha256, reading("abc")), Put::stored);
  EXPECT_EQ(store.unused_since(part_of(sha256), year_2020), std::vector<std::string>{});
}

TEST(AssetStoreBound, RejectsPutsAboveItUntilAssetsAreRemoved) {
  const TemporaryDirectory directory;
  const auto clock = [] { return 1; };
  for (const std::shared_ptr<AssetStore>& store : std::initializer_list<std::shared_ptr<AssetStore>>{
           std::make_shared<FileAssetStore>(directory.path(), clock, 10),
           make_shared_store<SharedAssetStore>(std::make_unique<BucketUnderTest>("assets"), clock, 10)}) {
    const auto put = [&](const std::string& bytes) { return store->put(tracer::sha256_hex(bytes), reading(bytes)); };
    EXPECT_EQ(put("sixsix"), Put::stored);
    EXPECT_EQ(put("fivef"), Put::quota_exceeded);
    EXPECT_FALSE(store->use(tracer::sha256_hex("fivef")));
    EXPECT_EQ(store->bytes(), 6u);
    EXPECT_EQ(put("four"), Put::stored) << "exactly full";
    EXPECT_EQ(put("sixsix"), Put::was_there) << "existing bytes need no space";
    EXPECT_EQ(put("x"), Put::quota_exceeded);
    EXPECT_TRUE(store->remove_unused_since(tracer::sha256_hex("four"), 2));
    EXPECT_EQ(store->bytes(), 6u);
    EXPECT_EQ(put("x"), Put::stored);
  }
  EXPECT_TRUE(std::filesystem::is_empty(directory.path() + "/tmp"));
}

TEST(AssetStoreBound, HoldsOverARestartAndWhileManyPutAtOnce) {
  const TemporaryDirectory directory;
  {
    FileAssetStore store(directory.path(), [] { return 1; });
    const std::string bytes(100, 'a');
    store.put(tracer::sha256_hex(bytes), reading(bytes));
  }
  FileAssetStore store(
      directory.path(), [] { return 1; }, 1000);
  EXPECT_EQ(store.bytes(), 100u);
  in_threads(4, [&](int thread) {
    for (int i = 0; i < 5; ++i) {
      const std::string bytes(100, static_cast<char>('b' + 5 * thread + i)), same(50, static_cast<char>('A' + i));
      store.put(tracer::sha256_hex(bytes), reading(bytes));
      store.put(tracer::sha256_hex(same), reading(same));  // all threads these: counted once
    }
  });
  const std::uintmax_t on_the_disk = bytes_in(directory.path());
  EXPECT_EQ(store.bytes(), on_the_disk);
  EXPECT_LE(on_the_disk, 1000u);
  EXPECT_GE(on_the_disk, 900u) << "nothing was refused that had room";
}

TEST(AssetCollector, CollectsFromItsStartAndStopsAtOnce) {
  TemporaryStores jobs;
  std::atomic<std::int64_t> now = 1'000;
  FileAssetStore assets(jobs.directory.path() + "/uploads", [&] { return now.load(); });
  const std::string bytes = "abc";
  assets.put(tracer::sha256_hex(bytes), reading(bytes));
  now = 10'000;
  std::atomic<bool> logged = false;
  const Log log = [&](LogLevel, std::string_view event, const LogFields&) {
    logged = logged || event == "assets_collected";
  };
  const auto collector =
      collect_assets(assets, jobs.store.all().maintenance, [&] { return now.load(); }, log,
                     {.age = std::chrono::milliseconds(8'000), .step_pause = std::chrono::milliseconds(0)});
  while (!logged) std::this_thread::yield();
  EXPECT_FALSE(assets.use(tracer::sha256_hex(bytes)));
}
