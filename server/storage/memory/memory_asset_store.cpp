#include "server/storage/memory/memory_asset_store.h"

#include <array>
#include <utility>

#include "tracer/sha256.h"

namespace queue {
namespace {

std::string read_all(const AssetStore::Read& read) {
  std::string bytes;
  std::array<char, 1 << 16> chunk{};
  while (const std::size_t got = read(bytes.size(), chunk.data(), chunk.size())) bytes.append(chunk.data(), got);
  return bytes;
}

}  // namespace

AssetStore::Put MemoryAssetStore::put(const std::string& sha256, const Read& read) {
  auto bytes = std::make_shared<const std::string>(read_all(read));
  if (tracer::sha256_hex(*bytes) != sha256) return Put::other_bytes;
  const std::lock_guard lock(mutex_);
  const std::uint64_t size = bytes->size();
  const bool is_new = !assets_.contains(sha256);
  if (is_new && (bytes_ > bytes_max_ || size > bytes_max_ - bytes_)) return Put::no_room;
  assets_.insert_or_assign(sha256, Asset{std::move(bytes), clock_()});
  if (is_new) bytes_ += size;
  return is_new ? Put::stored : Put::was_there;
}

std::uint64_t MemoryAssetStore::bytes() {
  const std::lock_guard lock(mutex_);
  return bytes_;
}

bool MemoryAssetStore::use(const std::string& sha256) {
  const std::lock_guard lock(mutex_);
  const auto found = assets_.find(sha256);
  if (found == assets_.end()) return false;
  found->second.used = clock_();
  return true;
}

std::unique_ptr<ArtifactReader> MemoryAssetStore::open(const std::string& sha256) {
  const std::lock_guard lock(mutex_);
  const auto found = assets_.find(sha256);
  if (found == assets_.end()) return nullptr;
  return std::make_unique<BytesReader>(found->second.bytes);
}

std::vector<std::string> MemoryAssetStore::unused_since(int part, std::int64_t then) {
  const std::lock_guard lock(mutex_);
  std::vector<std::string> names;
  for (const auto& [name, asset] : assets_) {
    if (std::stoi(name.substr(0, 2), nullptr, 16) == part && asset.used < then) names.push_back(name);
  }
  return names;
}

bool MemoryAssetStore::remove_unused_since(const std::string& sha256, std::int64_t then) {
  const std::lock_guard lock(mutex_);
  const auto found = assets_.find(sha256);
  if (found == assets_.end() || found->second.used >= then) return false;
  bytes_ -= found->second.bytes->size();
  assets_.erase(found);
  return true;
}

}  // namespace queue
