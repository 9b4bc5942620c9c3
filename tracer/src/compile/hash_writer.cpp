#include "tracer/src/compile/hash_writer.h"

#include <openssl/evp.h>

#include <new>

namespace tracer {

void HashWriter::Free::operator()(evp_md_ctx_st* context) const { EVP_MD_CTX_free(context); }

// Without memory is the one way in which any of these fails.
HashWriter::HashWriter() : context_(EVP_MD_CTX_new()) {
  if (context_ == nullptr || EVP_DigestInit_ex(context_.get(), EVP_sha256(), nullptr) != 1) throw std::bad_alloc();
}

void HashWriter::add(const void* bytes, std::size_t count) {
  if (EVP_DigestUpdate(context_.get(), bytes, count) != 1) throw std::bad_alloc();
  bytes_ += count;
}

std::string HashWriter::end() {
  std::string digest(32, '\0');
  if (EVP_DigestFinal_ex(context_.get(), reinterpret_cast<unsigned char*>(digest.data()), nullptr) != 1)
    throw std::bad_alloc();
  return digest;
}

}  // namespace tracer
