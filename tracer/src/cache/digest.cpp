#include "tracer/src/cache/digest.h"

#include <algorithm>
#include <bit>
#include <cstring>

namespace tracer {
namespace {

/// RFC 7693, 2.6.
constexpr std::array<std::uint64_t, 8> initial{0x6a09e667f3bcc908, 0xbb67ae8584caa73b, 0x3c6ef372fe94f82b,
                                               0xa54ff53a5f1d36f1, 0x510e527fade682d1, 0x9b05688c2b3e6c1f,
                                               0x1f83d9abfb41bd6b, 0x5be0cd19137e2179};
/// RFC 7693, 2.7.
constexpr std::array<std::array<std::uint8_t, 16>, 10> order{{{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15},
                                                              {14, 10, 4, 8, 9, 15, 13, 6, 1, 12, 0, 2, 11, 7, 5, 3},
                                                              {11, 8, 12, 0, 5, 2, 15, 13, 10, 14, 3, 6, 7, 1, 9, 4},
                                                              {7, 9, 3, 1, 13, 12, 11, 14, 2, 6, 5, 10, 4, 0, 15, 8},
                                                              {9, 0, 5, 7, 2, 4, 10, 15, 14, 1, 11, 12, 6, 8, 3, 13},
                                                              {2, 12, 6, 10, 0, 11, 8, 3, 4, 13, 7, 5, 15, 14, 1, 9},
                                                              {12, 5, 1, 15, 14, 13, 4, 10, 0, 7, 6, 3, 9, 2, 8, 11},
                                                              {13, 11, 7, 14, 12, 1, 3, 9, 5, 0, 15, 4, 8, 6, 2, 10},
                                                              {6, 15, 14, 9, 11, 3, 0, 8, 12, 2, 13, 7, 1, 4, 10, 5},
                                                              {10, 2, 8, 4, 7, 6, 1, 5, 15, 11, 9, 14, 3, 12, 13, 0}}};
constexpr std::size_t digest_bytes = 32, rounds = 12;

using Words = std::array<std::uint64_t, 16>;

/// RFC 7693, 3.1.
void mix(Words& v, std::size_t a, std::size_t b, std::size_t c, std::size_t d, std::uint64_t x, std::uint64_t y) {
  v[a] += v[b] + x;
  v[d] = std::rotr(v[d] ^ v[a], 32);
  v[c] += v[d];
  v[b] = std::rotr(v[b] ^ v[c], 24);
  v[a] += v[b] + y;
  v[d] = std::rotr(v[d] ^ v[a], 16);
  v[c] += v[d];
  v[b] = std::rotr(v[b] ^ v[c], 63);
}

}  // namespace

Digest::Digest() : state_(initial) { state_[0] ^= 0x01010000u ^ digest_bytes; }

void Digest::add(const void* bytes, std::size_t count) {
  const auto* from = static_cast<const unsigned char*>(bytes);
  while (count > 0) {
    if (held_ == block_bytes) compress(false);
    const std::size_t part = std::min(count, block_bytes - held_);
    std::memcpy(block_.data() + held_, from, part);
    held_ += part;
    from += part;
    count -= part;
  }
}

/// RFC 7693, 3.2. The machine's byte order is little-endian, as the digest's words are.
void Digest::compress(bool last) {
  static_assert(std::endian::native == std::endian::little);
  compressed_ += held_;
  held_ = 0;
  Words message;
  std::memcpy(message.data(), block_.data(), block_bytes);
  Words v;
  std::copy(state_.begin(), state_.end(), v.begin());
  std::copy(initial.begin(), initial.end(), v.begin() + 8);
  v[12] ^= compressed_;
  if (last) v[14] = ~v[14];
  for (std::size_t round = 0; round < rounds; ++round) {
    const auto& s = order[round % order.size()];
    for (std::size_t i = 0; i < 4; ++i) mix(v, i, 4 + i, 8 + i, 12 + i, message[s[2 * i]], message[s[2 * i + 1]]);
    for (std::size_t i = 0; i < 4; ++i)
      mix(v, i, 4 + (i + 1) % 4, 8 + (i + 2) % 4, 12 + (i + 3) % 4, message[s[8 + 2 * i]], message[s[9 + 2 * i]]);
  }
  for (std::size_t i = 0; i < state_.size(); ++i) state_[i] ^= v[i] ^ v[8 + i];
}

std::string Digest::end() {
  std::fill(block_.begin() + static_cast<std::ptrdiff_t>(held_), block_.end(), static_cast<unsigned char>(0));
  compress(true);
  std::string digest(digest_bytes, '\0');
  std::memcpy(digest.data(), state_.data(), digest_bytes);
  return digest;
}

}  // namespace tracer
