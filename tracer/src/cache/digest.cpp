#include "tracer/src/cache/digest.h"

#include <openssl/evp.h>

#include <new>

namespace tracer {

void Digest::Free::operator()(evp_md_ctx_st* context) const { EVP_MD_CTX_free(context); }

// Without memory is the one way in which any of these fails.
Digest::Digest() : context_(EVP_MD_CTX_new()) {
  if (context_ == nullptr || EVP_DigestInit_ex(context_.get(), EVP_sha256(), nullptr) != 1) throw std::bad_alloc();
}

void Digest::add(const void* bytes, std::size_t count) {
  if (EVP_DigestUpdate(context_.get(), bytes, count) != 1) throw std::bad_alloc();
  bytes_ += count;
}

std::string Digest::end() {
  std::string digest(32, '\0');
  if (EVP_DigestFinal_ex(context_.get(), reinterpret_cast<unsigned char*>(digest.data()), nullptr) != 1)
    throw std::bad_alloc();
  return digest;
}

}  // namespace tracer
