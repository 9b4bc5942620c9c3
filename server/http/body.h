#pragma once
/// The body of a request while it arrives: small ones in memory, large ones in an unlinked file, all of them within one
/// budget, so that no number of clients can fill memory or disk.

#include <atomic>
#include <cstdint>
#include <string>
#include <string_view>

namespace http {

/// Shared by all bodies of a gate; must outlive them. Thread-safe.
struct BodyBudget {
  std::string directory;                       ///< where spooled bodies live, nameless
  std::uint64_t body_memory_bytes = 1u << 20;  ///< of one body; what is longer goes to a file. Few scenes are longer
  std::uint64_t memory_bytes = 64u << 20;      ///< of all bodies; then even short ones go to files
  std::uint64_t file_bytes = 2ull << 30;       ///< of all spooled bodies: 32 of the largest at once
  std::atomic<std::uint64_t> memory_used{0};
  std::atomic<std::uint64_t> file_used{0};
};

class Body {
 public:
  Body() = default;  ///< no body
  explicit Body(BodyBudget& budget) : budget_(&budget) {}
  Body(Body&& other) noexcept;
  Body& operator=(Body&& other) noexcept;
  ~Body();

  /// False when the budget or the disk is exhausted; the body is useless then. Precondition: made with a budget.
  bool append(std::string_view bytes);

  [[nodiscard]] std::uint64_t size_bytes() const { return size_; }
  [[nodiscard]] bool spooled() const { return fd_ >= 0; }

  /// Up to `size` bytes at `offset`; fewer only at the end. Throws std::system_error as `take`. Nothing after `take`.
  std::size_t read(std::uint64_t offset, char* into, std::size_t size) const;

  /// All of it; nothing is left here. Throws std::system_error when a spooled body cannot be read back.
  std::string take();

 private:
  bool spool();
  void release();

  BodyBudget* budget_ = nullptr;
  std::string memory_;
  int fd_ = -1;
  std::uint64_t size_ = 0;
};

}  // namespace http
