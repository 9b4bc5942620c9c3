#pragma once
/// SHA-256 (FIPS 180-4), computed by OpenSSL. Content addresses of files, key hashes and cache keys use it: two inputs
/// with equal digests are treated as equal. Library `tracer_hash`; rendering without a cache does not need it.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

struct evp_md_ctx_st;

namespace tracer {

/// Digest of bytes that arrive in parts. One thread at a time. Every function throws std::bad_alloc if OpenSSL has no
/// memory, its only way to fail.
class Sha256 {
 public:
  Sha256();
  void add(const void* bytes, std::size_t size);
  [[nodiscard]] std::uint64_t size_bytes() const { return size_bytes_; }  ///< total added so far
  /// 32 bytes. Ends the hash: neither add() nor digest() may be called afterwards.
  std::string digest();
  /// digest() as 64 lower-case hex digits.
  std::string hex();

 private:
  struct Free {
    void operator()(evp_md_ctx_st* context) const;
  };
  std::unique_ptr<evp_md_ctx_st, Free> context_;
  std::uint64_t size_bytes_ = 0;
};

/// Sha256::hex() of `bytes`.
std::string sha256_hex(std::string_view bytes);

/// HMAC-SHA-256 (RFC 2104): 32 bytes.
std::string hmac_sha256(std::string_view key, std::string_view text);

/// Bytes as lower-case hex digits.
std::string hex_of(std::string_view bytes);

/// True for exactly 64 lower-case hex digits. Names from outside must pass this test before they become part of a path.
bool is_sha256(std::string_view name);

}  // namespace tracer
