#pragma once
/// BLAKE2b of 32 bytes (Saarinen, Aumasson 2015, RFC 7693), without a key: a name for bytes as they come. Two of the
/// same name cannot be found, so what has it need not be compared. Takes a nanosecond a byte.

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

namespace tracer {

class Digest {
 public:
  Digest();
  void add(const void* bytes, std::size_t count);
  [[nodiscard]] std::uint64_t bytes() const { return compressed_ + held_; }  ///< so far
  /// 32 bytes. Once; nothing is added afterwards.
  std::string end();

 private:
  static constexpr std::size_t block_bytes = 128;
  void compress(bool last);

  std::array<std::uint64_t, 8> state_;
  std::array<unsigned char, block_bytes> block_{};
  std::size_t held_ = 0;  ///< of the block; a full one waits for what comes, for the last is compressed otherwise
  std::uint64_t compressed_ = 0;
};

}  // namespace tracer
