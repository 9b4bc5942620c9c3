#pragma once
/// The store of images: immutable bytes under their sha256. Thread-safe. Fails with StoreFailure; then nothing is
/// stored.

#include <cstdint>
#include <memory>
#include <string>
#include <utility>

#include "server/queue/job_store.h"

namespace queue {

/// An open artifact: positioned reads, valid even if it is removed meanwhile. Thread-safe.
class ArtifactReader {
 public:
  virtual ~ArtifactReader() = default;
  [[nodiscard]] virtual std::uint64_t size_bytes() const = 0;
  /// Reads up to `size` bytes at `offset`; fewer only at the end. Throws StoreFailure, of kind `damaged` where the
  /// bytes turn out not to be those of the name.
  virtual std::size_t read(std::uint64_t offset, char* into, std::size_t size) const = 0;
};

/// Bytes in memory.
class MemoryReader final : public ArtifactReader {
 public:
  explicit MemoryReader(std::shared_ptr<const std::string> bytes) : bytes_(std::move(bytes)) {}
  explicit MemoryReader(std::string bytes) : bytes_(std::make_shared<const std::string>(std::move(bytes))) {}
  [[nodiscard]] std::uint64_t size_bytes() const override { return bytes_->size(); }
  std::size_t read(std::uint64_t offset, char* into, std::size_t size) const override {
    return offset < bytes_->size() ? bytes_->copy(into, size, offset) : 0;
  }

 private:
  const std::shared_ptr<const std::string> bytes_;
};

class ArtifactStore {
 public:
  virtual ~ArtifactStore() = default;

  struct Stored {
    std::string sha256;
    std::uint64_t bytes = 0;
  };
  /// Copies everything readable from `fd` (from offset 0) into the store and returns its name. Never visible
  /// half-written while the machine runs. Storing the same bytes twice is one artifact. `durable`: power loss that
  /// keeps a later write to the job store keeps the artifact. Otherwise power loss may leave nothing, or a damaged
  /// artifact, which is replaced by the next put of the same bytes.
  virtual Stored put(int fd, bool durable = true) = 0;

  /// A job is about to name an existing artifact: no node removes it within a day. No effect where there is one node.
  virtual void keep(const std::string& /*sha256*/) {}

  virtual void sync(const std::string& sha256) = 0;  ///< makes an existing artifact durable, as put

  /// Null when it does not exist, or its bytes are not those of its name. Large artifacts are read for this once after
  /// the start, or compared by their reader. Without `verified` nothing is compared: for readers that do.
  virtual std::unique_ptr<ArtifactReader> open(const std::string& sha256, bool verified = true) = 0;
  virtual void remove(const std::string& sha256) = 0;  ///< no effect when it does not exist
};

}  // namespace queue
