#include "server/queue/artifact_pins.h"

#include <algorithm>
#include <exception>

namespace queue {

std::unique_ptr<ArtifactReader> ArtifactPins::open(const Artifact& artifact, bool verified) {
  auto reader = artifacts_.open(artifact.sha256, verified);
  if (reader && reader->size_bytes() != artifact.bytes) return nullptr;
  return reader;
}

bool ArtifactPins::is_intact(const Artifact& artifact) {
  const auto reader = open(artifact);
  if (!reader) return false;
  std::vector<char> piece(1u << 20);
  try {
    for (std::uint64_t done = 0; done < artifact.bytes;) {
      const std::size_t count = reader->read(done, piece.data(), piece.size());
      if (count == 0) return false;
      done += count;
    }
  } catch (const StoreFailure& failure) {
    if (failure.kind != StoreFailure::Kind::damaged) throw;
    return false;
  }
  return true;
}

void ArtifactPins::collect(const std::string& sha256) noexcept {
  const std::lock_guard lock(mutex_);
  if (const auto pin = pins_.find(sha256); pin != pins_.end()) {
    pin->second.collect = true;
    return;
  }
  try {
    if (references_.is_artifact_referenced(sha256)) return;
    artifacts_.remove(sha256);
  } catch (const std::exception& failure) {
    log_(LogLevel::warning, "artifact_not_collected", {{"sha256", sha256}, {"detail", failure.what()}});
  }
  ++removals_;
}

ArtifactStore::Stored ArtifactPins::Pinned::put(int fd, bool durable) {
  const std::uint64_t removals = pins_.removals_;
  ArtifactStore::Stored stored = pins_.artifacts_.put(fd, durable);
  pin(stored.sha256);
  if (pins_.removals_ == removals || pins_.artifacts_.open(stored.sha256)) return stored;
  return pins_.artifacts_.put(fd, durable);  // it was removed between put and pin; the pin prevents a second time
}

bool ArtifactPins::Pinned::hold(const Artifact& artifact, bool sync) {
  const bool is_new = pin(artifact.sha256);
  try {
    if (is_new) pins_.artifacts_.keep(artifact.sha256);
    if (!pins_.open(artifact)) return false;
  } catch (const StoreFailure& failure) {
    if (failure.kind != StoreFailure::Kind::unavailable) throw;
    pins_.log_(LogLevel::warning, "artifact_not_available", {{"sha256", artifact.sha256}, {"detail", failure.what()}});
    return false;
  }
  if (sync && is_new) pins_.artifacts_.sync(artifact.sha256);
  return true;
}

bool ArtifactPins::Pinned::hold(const std::vector<Artifact>& artifacts, bool sync) {
  return std::ranges::all_of(artifacts, [&](const Artifact& artifact) { return hold(artifact, sync); });
}

bool ArtifactPins::Pinned::pin(const std::string& sha256) {
  if (!held_.insert(sha256).second) return false;
  const std::lock_guard lock(pins_.mutex_);
  ++pins_.pins_[sha256].count;
  return true;
}

ArtifactPins::Pinned::~Pinned() {
  for (const std::string& sha256 : held_) {
    {
      const std::lock_guard lock(pins_.mutex_);
      const auto pin = pins_.pins_.find(sha256);
      pin->second.collect |= !named_;
      if (--pin->second.count > 0) continue;
      const bool collect = pin->second.collect;
      pins_.pins_.erase(pin);
      if (!collect) continue;
    }
    pins_.collect(sha256);
  }
}

}  // namespace queue
