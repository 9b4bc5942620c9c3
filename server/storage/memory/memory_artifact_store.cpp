#include "server/storage/memory/memory_artifact_store.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <utility>

#include "tracer/sha256.h"

namespace queue {
namespace {

std::string read_all(int fd) {
  std::string bytes;
  std::array<char, 1 << 16> chunk;
  for (;;) {
    const ssize_t got = pread(fd, chunk.data(), chunk.size(), static_cast<off_t>(bytes.size()));
    if (got == 0) return bytes;
    if (got > 0) bytes.append(chunk.data(), static_cast<std::size_t>(got));
    if (got < 0 && errno != EINTR) throw StoreFailure(StoreFailure::Kind::unavailable, std::strerror(errno));
  }
}

}  // namespace

ArtifactStore::Stored MemoryArtifactStore::put(int fd, std::size_t small_bytes) {
  auto bytes = std::make_shared<const std::string>(read_all(fd));
  Stored stored{tracer::sha256_hex(*bytes), bytes->size()};
  if (bytes->size() <= small_bytes && small_bytes > 0) {
    stored.small = *bytes;
    return stored;
  }
  const std::lock_guard lock(mutex_);
  artifacts_.try_emplace(stored.sha256, std::move(bytes));
  return stored;
}

std::unique_ptr<ArtifactReader> MemoryArtifactStore::open(const std::string& sha256) {
  const std::lock_guard lock(mutex_);
  const auto found = artifacts_.find(sha256);
  if (found == artifacts_.end()) return nullptr;
  return std::make_unique<BytesReader>(found->second);
}

void MemoryArtifactStore::remove(const std::string& sha256) {
  const std::lock_guard lock(mutex_);
  artifacts_.erase(sha256);
}

}  // namespace queue
