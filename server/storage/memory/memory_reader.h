#pragma once
/// Bytes in memory as an ArtifactReader, valid after their removal. Private to this folder.

#include <memory>
#include <string>
#include <utility>

#include "server/jobs/artifact_store.h"

namespace jobs {

class MemoryReader final : public ArtifactReader {
 public:
  explicit MemoryReader(std::shared_ptr<const std::string> bytes) : bytes_(std::move(bytes)) {}
  std::uint64_t size_bytes() const override { return bytes_->size(); }
  std::size_t read(std::uint64_t offset, char* into, std::size_t size) const override {
    return offset >= bytes_->size() ? 0 : bytes_->copy(into, size, offset);
  }

 private:
  std::shared_ptr<const std::string> bytes_;
};

}  // namespace jobs
