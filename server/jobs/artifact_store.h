#pragma once
/// Where pictures live: immutable bytes under their sha256. Thread-safe. Fails with StoreFailure; then nothing is
/// there.

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "server/jobs/job_store.h"

namespace jobs {

/// An open artifact: positioned reads, valid even if it is removed meanwhile. Thread-safe.
class ArtifactReader {
 public:
  virtual ~ArtifactReader() = default;
  [[nodiscard]] virtual std::uint64_t size_bytes() const = 0;
  /// Reads up to `size` bytes at `offset`; fewer only at the end. Throws StoreFailure.
  virtual std::size_t read(std::uint64_t offset, char* into, std::size_t size) const = 0;
};

class ArtifactStore {
 public:
  virtual ~ArtifactStore() = default;

  struct Stored {
    std::string sha256;
    std::uint64_t bytes = 0;
  };
  /// Copies everything readable from `fd` (from offset 0) into the store and returns its name. Durable when it returns;
  /// never visible half-written. Storing the same bytes twice is one artifact.
  virtual Stored put(int fd) = 0;

  virtual std::unique_ptr<ArtifactReader> open(const std::string& sha256) = 0;  ///< null when not there
  virtual void remove(const std::string& sha256) = 0;                           ///< nothing when not there
};

}  // namespace jobs
