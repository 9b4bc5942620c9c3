#pragma once
/// An AssetStore for tests: everything in this process's memory, nothing survives it. Otherwise it keeps every promise
/// of the port and passes the same conformance suite.

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "server/queue/asset_store.h"
#include "server/queue/clock.h"

namespace queue {

class MemoryAssetStore final : public AssetStore {
 public:
  explicit MemoryAssetStore(Clock clock, std::uint64_t bytes_max = UINT64_MAX)
      : clock_(std::move(clock)), bytes_max_(bytes_max) {}

  Put put(const std::string& sha256, const Read& read) override;
  std::uint64_t bytes() override;
  bool use(const std::string& sha256) override;
  std::unique_ptr<ArtifactReader> open(const std::string& sha256) override;
  std::vector<std::string> unused_since(int part, std::int64_t then) override;
  bool remove_unused_since(const std::string& sha256, std::int64_t then) override;

 private:
  struct Asset {
    std::shared_ptr<const std::string> bytes;
    std::int64_t used = 0;
  };
  Clock clock_;
  std::uint64_t bytes_max_;
  std::mutex mutex_;
  std::map<std::string, Asset> assets_;
  std::uint64_t bytes_ = 0;
};

}  // namespace queue
