#pragma once
/// Where large images live: immutable bytes under their sha256. (Small ones stand beside the rows that name them:
/// JobStore::succeed.) Thread-safe. Fails with StoreFailure; then nothing is there.

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "server/queue/job_store.h"

namespace queue {

/// An open artifact: positioned reads, valid even if it is removed meanwhile. Thread-safe.
class ArtifactReader {
 public:
  virtual ~ArtifactReader() = default;
  [[nodiscard]] virtual std::uint64_t size_bytes() const = 0;
  /// Reads up to `size` bytes at `offset`; fewer only at the end. Throws StoreFailure.
  virtual std::size_t read(std::uint64_t offset, char* into, std::size_t size) const = 0;
};

/// Bytes in memory as an artifact.
class BytesReader final : public ArtifactReader {
 public:
  explicit BytesReader(std::shared_ptr<const std::string> bytes) : bytes_(std::move(bytes)) {}
  [[nodiscard]] std::uint64_t size_bytes() const override { return bytes_->size(); }
  std::size_t read(std::uint64_t offset, char* into, std::size_t size) const override {
    return offset >= bytes_->size() ? 0 : bytes_->copy(into, size, offset);
  }

 private:
  std::shared_ptr<const std::string> bytes_;
};

class ArtifactStore {
 public:
  virtual ~ArtifactStore() = default;

  struct Stored {
    std::string sha256;
    std::uint64_t bytes = 0;
    std::optional<std::string> small{};  ///< the bytes themselves, where put has only named them
  };
  /// Copies everything readable from `fd` (from offset 0) into the store and returns its name. Durable when it returns;
  /// never visible half-written. Storing the same bytes twice is one artifact. What has at most `small_bytes`, where
  /// that is not 0, is named and given back, and not stored.
  virtual Stored put(int fd, std::size_t small_bytes = 0) = 0;

  virtual std::unique_ptr<ArtifactReader> open(const std::string& sha256) = 0;  ///< null when not there
  virtual void remove(const std::string& sha256) = 0;                           ///< nothing when not there
};

}  // namespace queue
