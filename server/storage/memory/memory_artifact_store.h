#pragma once
/// An ArtifactStore for tests: everything in this process's memory, nothing survives it. Otherwise it keeps every
/// promise of the port and passes the same conformance suite.

#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "server/queue/artifact_store.h"

namespace queue {

class MemoryArtifactStore final : public ArtifactStore {
 public:
  Stored put(int fd, std::size_t small_bytes = 0) override;
  std::unique_ptr<ArtifactReader> open(const std::string& sha256) override;
  void remove(const std::string& sha256) override;

 private:
  std::mutex mutex_;
  std::map<std::string, std::shared_ptr<const std::string>> artifacts_;
};

}  // namespace queue
