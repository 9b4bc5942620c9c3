#include "server/queue/artifact_pins.h"

#include <exception>

namespace queue {

std::unique_ptr<ArtifactReader> ArtifactPins::open(const std::string& sha256) {
  if (auto small = store_.small_image(sha256)) {
    return std::make_unique<BytesReader>(std::make_shared<const std::string>(*std::move(small)));
  }
  return artifacts_.open(sha256);
}

void ArtifactPins::collect(const std::string& sha256) noexcept {
  const std::lock_guard lock(mutex_);
  if (pins_.contains(sha256)) return;  // whoever holds the pin collects after it
  try {
    if (store_.references(sha256)) return;
    store_.forget_small_image(sha256);
    artifacts_.remove(sha256);
  } catch (const std::exception& failure) {
    log_(LogLevel::warning, "artifact_not_collected", {{"sha256", sha256}, {"detail", failure.what()}});
  }
}

ArtifactStore::Stored ArtifactPins::Pinned::put(int fd) {
  ArtifactStore::Stored stored = pins_.artifacts_.put(fd, pins_.small_bytes_);
  if (stored.small) return stored;
  // A removal may have come between put and pin; from here on none can.
  if (!hold(stored.sha256)) stored = pins_.artifacts_.put(fd);
  return stored;
}

bool ArtifactPins::Pinned::hold(const std::string& sha256) {
  {
    const std::lock_guard lock(pins_.mutex_);
    ++pins_.pins_[sha256];
  }
  held_.push_back(sha256);
  return pins_.open(sha256) != nullptr;
}

ArtifactPins::Pinned::~Pinned() {
  for (const std::string& sha256 : held_) {
    {
      const std::lock_guard lock(pins_.mutex_);
      const auto pin = pins_.pins_.find(sha256);
      if (--pin->second > 0) continue;
      pins_.pins_.erase(pin);
    }
    pins_.collect(sha256);
  }
}

}  // namespace queue
