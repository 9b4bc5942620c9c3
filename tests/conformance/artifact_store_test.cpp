/// The contract of an artifact store, run against every implementation.

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <thread>

#include "tests/conformance/bucket_under_test.h"
#include "tests/conformance/memory_file.h"
#include "tests/conformance/test_store.h"
#include "tests/support/threads.h"

using namespace queue;
using namespace storage::files;

namespace {

struct ArtifactStoreKind {
  std::string name;
  std::function<std::shared_ptr<ArtifactStore>(const std::string& directory)> make;
};

std::shared_ptr<ArtifactStore> make_files(const std::string& directory) {
  return std::make_shared<FileArtifactStore>(directory + "/artifacts");
}

/// Small ones as rows, the others as files.
struct RowsAndFiles {
  explicit RowsAndFiles(const std::string& directory) : stores(directory, {.synchronous = false}), files(directory) {}
  storage::sqlite::SqliteStores stores;
  FileArtifactStore files;
  storage::sqlite::SmallArtifactStore store{stores, files};
};

std::shared_ptr<ArtifactStore> make_rows_and_files(const std::string& directory) {
  const auto all = std::make_shared<RowsAndFiles>(directory);
  return {all, &all->store};
}

/// Removes at once what was used now.
std::shared_ptr<ArtifactStore> make_shared(std::unique_ptr<storage::objects::ObjectStore> objects) {
  return make_shared_store<storage::objects::SharedArtifactStore>(std::move(objects), system_clock(),
                                                                  std::chrono::seconds(-60));
}

std::shared_ptr<ArtifactStore> make_shared_directory(const std::string& directory) {
  return make_shared(storage::objects::objects_in_directory(directory + "/artifacts"));
}

std::shared_ptr<ArtifactStore> make_bucket(const std::string& /*directory*/) {
  return make_shared(std::make_unique<BucketUnderTest>("artifacts"));
}

class ArtifactStoreConformance : public testing::TestWithParam<ArtifactStoreKind> {
 protected:
  ArtifactStore& store() { return *store_; }
  std::string put(std::string_view bytes) { return store().put(MemoryFile(bytes).fd()).sha256; }
  std::optional<std::string> get(const std::string& sha256) { return bytes_of(store().open(sha256)); }

 private:
  const TemporaryDirectory directory_;
  const std::shared_ptr<ArtifactStore> store_ = GetParam().make(directory_.path());
};

}  // namespace

TEST_P(ArtifactStoreConformance, NamesBytesByTheirSha256) {
  // FIPS 180-4 examples, and of nothing.
  EXPECT_EQ(put("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(put("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
  EXPECT_EQ(put(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
}

TEST_P(ArtifactStoreConformance, ReturnsTheBytesThatWerePut) {
  for (const std::string& bytes : {std::string(), std::string("abc"), std::string(1 << 18, 'x'), large_bytes()}) {
    const ArtifactStore::Stored stored = store().put(MemoryFile(bytes).fd());
    EXPECT_EQ(stored.bytes, bytes.size());
    EXPECT_EQ(get(stored.sha256), bytes) << bytes.size() << " bytes";
  }
}

TEST_P(ArtifactStoreConformance, ReadsADescriptorFromItsStart) {
  const MemoryFile file("abc");
  lseek(file.fd(), 2, SEEK_SET);
  EXPECT_EQ(get(store().put(file.fd()).sha256), "abc");
}

TEST_P(ArtifactStoreConformance, ReadsAnyRangeAndFewerBytesOnlyAtTheEnd) {
  const std::string bytes = large_bytes();
  const std::unique_ptr<ArtifactReader> reader = store().open(put(bytes));
  for (const std::uint64_t offset : {0ul, 1ul, 262'143ul, 1'499'990ul, 1'500'000ul, 9'000'000'000ul}) {
    std::string part(500'000, '?');
    part.resize(reader->read(offset, part.data(), part.size()));
    EXPECT_EQ(part, offset < bytes.size() ? bytes.substr(offset, 500'000) : "") << "at " << offset;
  }
}

TEST_P(ArtifactStoreConformance, StoresEqualBytesOnce) {
  const std::string sha256 = put("abc");
  EXPECT_EQ(put("abc"), sha256);
  store().remove(sha256);
  EXPECT_FALSE(get(sha256));
  EXPECT_EQ(put("abc"), sha256);
  EXPECT_EQ(get(sha256), "abc");
}

TEST_P(ArtifactStoreConformance, AnOpenReaderOutlivesTheRemoval) {
  const std::string sha256 = put("abc");
  const std::unique_ptr<ArtifactReader> reader = store().open(sha256);
  store().remove(sha256);
  EXPECT_EQ(bytes_of(reader), "abc");
}

TEST_P(ArtifactStoreConformance, FindsNothingUnderOtherNames) {
  const std::string sha256 = put("abc");
  std::string upper = sha256;
  for (char& c : upper) c = static_cast<char>(std::toupper(c));
  for (const std::string& name : {std::string(), std::string("../../etc/passwd"), sha256.substr(1), sha256 + "0", upper,
                                  std::string(64, '/'), std::string(63, 'a') + "\n", std::string(64, '0')}) {
    EXPECT_EQ(store().open(name), nullptr) << name;
    EXPECT_NO_THROW(store().remove(name)) << name;
  }
  EXPECT_EQ(get(sha256), "abc");
}

TEST_P(ArtifactStoreConformance, RejectsADescriptorThatCannotBeRead) { EXPECT_THROW(store().put(-1), StoreFailure); }

TEST_P(ArtifactStoreConformance, StoresConcurrentPutsOfEqualAndDifferentBytes) {
  in_threads(8, [&](int thread) {
    for (int i = 0; i < 20; ++i) {
      put("shared " + std::to_string(i));
      put("own " + std::to_string(thread) + " " + std::to_string(i));
    }
  });
  for (int i = 0; i < 20; ++i) {
    for (const std::string& bytes : {"shared " + std::to_string(i), "own 7 " + std::to_string(i)}) {
      EXPECT_EQ(get(put(bytes)), bytes);
    }
  }
}

TEST_P(ArtifactStoreConformance, PutsBytesThatAreRemovedAtTheSameTime) {
  const std::string sha256 = put("abc");
  {
    const std::jthread remover([&](const std::stop_token& stop) {
      while (!stop.stop_requested()) store().remove(sha256);
    });
    for (int i = 0; i < 200; ++i) EXPECT_NO_THROW(put("abc"));
  }
  put("abc");
  EXPECT_EQ(get(sha256), "abc");
}

INSTANTIATE_TEST_SUITE_P(Stores, ArtifactStoreConformance,
                         testing::Values(ArtifactStoreKind{"Files", make_files},
                                         ArtifactStoreKind{"RowsAndFiles", make_rows_and_files},
                                         ArtifactStoreKind{"SharedDirectory", make_shared_directory},
                                         ArtifactStoreKind{"S3", make_bucket}),
                         [](const auto& kind) { return kind.param.name; });

TEST_F(FileArtifactStoreTest, KeepsArtifactsOverARestartAndDeletesIncompleteFiles) {
  const std::string artifacts = directory.path() + "/artifacts";
  const std::string sha256 = FileArtifactStore(artifacts).put(MemoryFile("abc").fd()).sha256;
  std::ofstream(artifacts + "/tmp/17") << "half";
  FileArtifactStore store(artifacts);
  EXPECT_NE(store.open(sha256), nullptr);
  EXPECT_TRUE(std::filesystem::is_empty(artifacts + "/tmp"));
}

TEST_F(FileArtifactStoreTest, ReportsThePathThatItCannotWrite) {
  const Failure failure = failure_of([] { FileArtifactStore("/proc/whittle"); });
  EXPECT_EQ(failure.kind, StoreFailure::Kind::unavailable);
  EXPECT_NE(failure.what.find("/proc/whittle"), std::string::npos) << failure.what;
}

TEST_F(FileArtifactStoreTest, ReplacesATruncatedFile) {
  FileArtifactStore store(directory.path());
  const std::string sha256 = store.put(MemoryFile("abc").fd(), false).sha256;
  std::filesystem::resize_file(directory.path() + "/" + asset_path(sha256), 0);
  EXPECT_EQ(FileArtifactStore(directory.path()).open(sha256), nullptr) << "after the next start";
  store.put(MemoryFile("abc").fd());
  EXPECT_EQ(store.open(sha256)->size_bytes(), 3u);
}

TEST_F(FileArtifactStoreTest, FindsAndReplacesChangedBytes) {
  const std::string sha256 = FileArtifactStore(directory.path()).put(MemoryFile("abc").fd()).sha256;
  const std::string path = directory.path() + "/" + asset_path(sha256);
  std::ofstream(path) << "abd";
  FileArtifactStore store(directory.path());
  EXPECT_EQ(store.open(sha256), nullptr);
  EXPECT_EQ(store.open(sha256, /*verified=*/false)->size_bytes(), 3u);
  store.put(MemoryFile("abc").fd(), false);
  ASSERT_NE(store.open(sha256), nullptr) << "replaced";

  std::ofstream(path) << "abd";
  EXPECT_NE(store.open(sha256), nullptr) << "was compared after the start: another size or the scrub would show it";
  const auto scrubbed = store.scrub();
  ASSERT_TRUE(scrubbed);
  EXPECT_EQ(scrubbed->artifact.sha256, sha256);
  EXPECT_TRUE(scrubbed->damaged);
  EXPECT_EQ(store.open(sha256), nullptr) << "found by the scrub";
  EXPECT_FALSE(store.scrub()) << "end of the round";
  EXPECT_TRUE(store.scrub()) << "of the next one";
}
