#pragma once
/// Bodies of requests while they are received: small ones in memory, large ones in an unlinked file, all of them within
/// one budget, so that no number of clients can fill the memory or the disk.

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "server/support/descriptor.h"

namespace http {

/// Shared by all bodies of a server; must outlive them. Thread-safe.
struct BodyBudget {
  std::string directory;                       ///< for spooled bodies, whose files have no name
  std::uint64_t body_memory_bytes = 1u << 20;  ///< longer bodies are spooled; few scenes are
  std::uint64_t memory_bytes = 64u << 20;      ///< all bodies in memory; above, short ones are spooled too
  std::uint64_t file_bytes = 2ull << 30;       ///< all spooled bodies: 32 of the largest
  std::atomic<std::uint64_t> memory_used{0};
  std::atomic<std::uint64_t> file_used{0};
};

class Body {
 public:
  Body() = default;  ///< no body
  explicit Body(BodyBudget& budget) : content_(std::make_unique<Content>(budget)) {}

  /// Returns false if the budget or the disk is exhausted; the body is then unusable. Precondition: it has a budget.
  bool append(std::string_view bytes);

  [[nodiscard]] std::uint64_t size_bytes() const { return content_ ? content_->size : 0; }
  [[nodiscard]] bool spooled() const { return content_ && content_->file; }

  /// Reads up to `size` bytes at `offset`; fewer only at the end. Throws std::system_error like `take`.
  std::size_t read(std::uint64_t offset, char* into, std::size_t size) const;

  /// Returns all bytes and leaves no body. Throws std::system_error if a spooled body cannot be read.
  std::string take();

 private:
  /// Its bytes count against the budget until it is destroyed.
  struct Content {
    explicit Content(BodyBudget& shared_budget) : budget(shared_budget) {}
    Content(const Content&) = delete;
    ~Content() { (file ? budget.file_used : budget.memory_used) -= size; }
    bool spool();

    BodyBudget& budget;
    std::string memory;
    support::Descriptor file;
    std::uint64_t size = 0;
  };
  std::unique_ptr<Content> content_;
};

}  // namespace http
