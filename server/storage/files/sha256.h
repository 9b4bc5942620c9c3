#pragma once
/// SHA-256 (FIPS 180-4) of bytes as they come.

#include <cstddef>
#include <memory>
#include <string>
#include <string_view>

struct evp_md_ctx_st;

namespace queue {

class Sha256 {
 public:
  Sha256();  ///< throws std::bad_alloc
  void add(const char* bytes, std::size_t size);
  /// 64 lower-case hex digits; nothing may be added afterwards.
  std::string hex();

 private:
  struct Free {
    void operator()(evp_md_ctx_st* context) const;
  };
  std::unique_ptr<evp_md_ctx_st, Free> context_;
};

/// Of all of `bytes` at once.
std::string sha256_of(std::string_view bytes);

/// Is this what `hex` gives? Nothing else may become a path.
bool is_sha256(std::string_view name);

}  // namespace queue
