#include "server/storage/objects/shared_stores.h"

#include <algorithm>
#include <utility>

#include "tracer/sha256.h"

namespace storage::objects {
namespace {

using Read = queue::AssetStore::Read;

[[noreturn]] void fail_damaged(const std::string& sha256) {
  throw queue::StoreFailure(queue::StoreFailure::Kind::damaged, "object " + sha256 + " has other bytes than its name");
}

/// Hashes what is read in order, and compares at the end.
class VerifyingReader final : public queue::ArtifactReader {
 public:
  VerifyingReader(std::unique_ptr<queue::ArtifactReader> reader, std::string sha256, files::NameSet& damaged)
      : reader_(std::move(reader)), sha256_(std::move(sha256)), damaged_(damaged) {}

  [[nodiscard]] std::uint64_t size_bytes() const override { return reader_->size_bytes(); }

  std::size_t read(std::uint64_t offset, char* into, std::size_t size) const override {
    const std::size_t count = reader_->read(offset, into, size);
    const std::lock_guard lock(mutex_);
    const std::uint64_t hashed = hash_.size_bytes(), end = offset + count;
    if (offset <= hashed && end > hashed) {
      hash_.add(into + (hashed - offset), end - hashed);
      is_damaged_ = end == size_bytes() && hash_.hex() != sha256_;
      if (is_damaged_) damaged_.add(sha256_);
    }
    if (is_damaged_ && end == size_bytes()) fail_damaged(sha256_);
    return count;
  }

 private:
  const std::unique_ptr<queue::ArtifactReader> reader_;
  const std::string sha256_;
  files::NameSet& damaged_;
  mutable std::mutex mutex_;
  mutable tracer::Sha256 hash_;
  mutable bool is_damaged_ = false;
};

}  // namespace

// ---- SharedArtifactStore

SharedArtifactStore::SharedArtifactStore(ObjectStore& objects, ObjectIndex& index, queue::Clock clock,
                                         std::chrono::milliseconds grace)
    : objects_(objects), index_(index), clock_(std::move(clock)), grace_(grace) {}

queue::ArtifactStore::Stored SharedArtifactStore::put(int fd, bool /*durable*/) {
  const Read read = files::contents_of(fd, "the source");
  Stored stored = files::hash_of(read);
  index_.begin(stored.sha256, stored.bytes, clock_());
  objects_.put(stored.sha256, stored.bytes, read);
  damaged_.remove(stored.sha256);
  return stored;
}

void SharedArtifactStore::keep(const std::string& sha256) { index_.begin(sha256, 0, clock_()); }

std::unique_ptr<queue::ArtifactReader> SharedArtifactStore::open(const std::string& sha256, bool verified) {
  if (!tracer::is_sha256(sha256) || (verified && damaged_.contains(sha256))) return nullptr;
  auto reader = objects_.open(sha256);
  if (!reader || !verified) return reader;
  if (reader->size_bytes() > small_bytes) return std::make_unique<VerifyingReader>(std::move(reader), sha256, damaged_);
  if (files::hash_of(files::contents_of(*reader)).sha256 != sha256) return nullptr;
  return reader;
}

void SharedArtifactStore::remove(const std::string& sha256) {
  if (!tracer::is_sha256(sha256)) return;
  index_.remove_unused_since(sha256, clock_() - grace_.count(), [&] { objects_.remove(sha256); });
}

int SharedArtifactStore::collect(int part) {
  int removed = 0;
  const std::int64_t then = clock_() - grace_.count();
  for (const std::string& sha256 : index_.unused_since(part, then)) {
    if (index_.remove_unused_since(sha256, then, [&] { objects_.remove(sha256); })) ++removed;
  }
  return removed;
}

// ---- SharedAssetStore

SharedAssetStore::SharedAssetStore(ObjectStore& objects, ObjectIndex& index, queue::Clock clock,
                                   std::uint64_t bytes_max)
    : objects_(objects), index_(index), clock_(std::move(clock)), bytes_max_(bytes_max) {}

queue::AssetStore::Put SharedAssetStore::put(const std::string& sha256, const Read& read) {
  if (!tracer::is_sha256(sha256)) return Put::other_bytes;
  const queue::ArtifactStore::Stored source = files::hash_of(read);
  if (source.sha256 != sha256) return Put::other_bytes;
  if (use(sha256)) return Put::was_there;
  if (!index_.begin(sha256, source.bytes, clock_(), bytes_max_)) return Put::quota_exceeded;
  objects_.put(sha256, source.bytes, read);
  index_.finish(sha256);
  return Put::stored;
}

bool SharedAssetStore::use(const std::string& sha256) {
  return tracer::is_sha256(sha256) && index_.use(sha256, clock_());
}

std::unique_ptr<queue::ArtifactReader> SharedAssetStore::open(const std::string& sha256) {
  return tracer::is_sha256(sha256) ? objects_.open(sha256) : nullptr;
}

std::vector<std::string> SharedAssetStore::unused_since(int part, std::int64_t then) {
  return index_.unused_since(part, then);
}

bool SharedAssetStore::remove_unused_since(const std::string& sha256, std::int64_t then) {
  if (!tracer::is_sha256(sha256)) return false;
  return index_.remove_unused_since(sha256, then, [&] { objects_.remove(sha256); });
}

std::string adopt_objects(ObjectStore& objects, ObjectIndex& index, const std::string& after, std::int64_t now) {
  const std::vector<ObjectStore::Object> found = objects.list(after);
  if (found.empty()) return {};
  index.adopt(found, now);
  return found.back().sha256;
}

}  // namespace storage::objects
