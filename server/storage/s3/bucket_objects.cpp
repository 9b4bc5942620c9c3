#include "server/storage/s3/bucket_objects.h"

#include <algorithm>
#include <chrono>
#include <ctime>
#include <mutex>
#include <utility>

#include "server/support/text_values.h"
#include "tracer/sha256.h"

namespace storage::s3 {
namespace {

constexpr std::size_t ahead_bytes = 1u << 20;  // 10 ms of a store in the same network

/// Reads ahead, since most callers read front to back in small pieces.
class ObjectReader final : public queue::ArtifactReader {
 public:
  ObjectReader(S3Client& client, std::string key, S3Client::Piece first)
      : client_(client), key_(std::move(key)), bytes_(first.object_bytes), window_(std::move(first.bytes)) {}

  [[nodiscard]] std::uint64_t size_bytes() const override { return bytes_; }

  std::size_t read(std::uint64_t offset, char* into, std::size_t size) const override {
    const std::lock_guard lock(mutex_);
    std::size_t filled = 0;
    while (filled < size && offset + filled < bytes_) {
      const std::uint64_t at = offset + filled;
      if (at < window_at_ || at >= window_at_ + window_.size()) load(at, size - filled);
      filled += window_.copy(into + filled, size - filled, static_cast<std::size_t>(at - window_at_));
    }
    return filled;
  }

 private:
  void load(std::uint64_t at, std::size_t size) const {
    auto piece = client_.get(key_, at, std::max(size, ahead_bytes));
    if (!piece || piece->bytes.empty() || piece->object_bytes != bytes_)
      throw queue::StoreFailure("S3: " + key_ + " was removed while it was read");
    window_ = std::move(piece->bytes);
    window_at_ = at;
  }

  S3Client& client_;
  const std::string key_;
  const std::uint64_t bytes_;
  mutable std::mutex mutex_;
  mutable std::string window_;
  mutable std::uint64_t window_at_ = 0;
};

class BucketObjects final : public objects::ObjectStore {
 public:
  BucketObjects(S3Client& client, std::string kind) : client_(client), kind_(std::move(kind)) {}

  void put(const std::string& sha256, std::uint64_t bytes, const queue::AssetStore::Read& read) override {
    client_.put(key_of(sha256), bytes, read);
  }

  std::unique_ptr<queue::ArtifactReader> open(const std::string& sha256) override {
    auto first = client_.get(key_of(sha256), 0, objects::small_bytes);
    return first ? std::make_unique<ObjectReader>(client_, key_of(sha256), *std::move(first)) : nullptr;
  }

  void remove(const std::string& sha256) override { client_.remove(key_of(sha256)); }

  std::vector<Object> list(const std::string& after) override {
    for (std::string key = after.empty() ? "" : key_of(after);;) {
      const std::vector<S3Client::Listed> listed = client_.list(kind_ + "/", key);
      std::vector<Object> objects;
      for (const S3Client::Listed& each : listed) {
        std::string name = each.key.substr(each.key.rfind('/') + 1);
        if (tracer::is_sha256(name) && each.key == key_of(name)) objects.push_back({std::move(name), each.bytes});
      }
      if (!objects.empty() || listed.empty()) return objects;
      key = listed.back().key;  // none of these is one of ours
    }
  }

  void remove_unfinished() override {
    const std::time_t yesterday = std::chrono::system_clock::to_time_t(std::chrono::system_clock::now()) - 24 * 3600;
    const std::string then = support::in_utc(yesterday, "%Y-%m-%dT%H:%M:%S");
    while (client_.abort_uploads(kind_ + "/", then) > 0) {
    }
  }

  [[nodiscard]] std::optional<std::string> url_of(const std::string& sha256,
                                                  const std::string& media_type) const override {
    return client_.presigned_url(key_of(sha256), std::chrono::hours(1), std::time(nullptr),
                                 {{"response-content-type", media_type}});
  }

 private:
  [[nodiscard]] std::string key_of(const std::string& sha256) const { return kind_ + "/" + queue::asset_path(sha256); }

  S3Client& client_;
  const std::string kind_;
};

}  // namespace

std::unique_ptr<objects::ObjectStore> objects_in_bucket(S3Client& client, std::string kind) {
  return std::make_unique<BucketObjects>(client, std::move(kind));
}

}  // namespace storage::s3
