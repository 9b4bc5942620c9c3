#include "server/webhooks/signature.h"

#include <openssl/evp.h>
#include <openssl/hmac.h>

#include <algorithm>
#include <array>
#include <new>
#include <optional>
#include <sstream>

namespace webhooks {
namespace {

constexpr std::string_view prefix = "whsec_";
constexpr std::size_t bytes_min = 24, bytes_max = 64;

const unsigned char* raw(std::string_view text) { return reinterpret_cast<const unsigned char*>(text.data()); }

std::string base64(std::string_view bytes) {
  std::string text(4 * ((bytes.size() + 2) / 3) + 1, '\0');
  const int size =
      EVP_EncodeBlock(reinterpret_cast<unsigned char*>(text.data()), raw(bytes), static_cast<int>(bytes.size()));
  text.resize(static_cast<std::size_t>(size));
  return text;
}

std::optional<Secret> read_secret(std::string_view text) {
  if (!text.starts_with(prefix)) return std::nullopt;
  text.remove_prefix(prefix.size());
  if (text.empty() || text.size() % 4 != 0 || text.size() > 4 * bytes_max) return std::nullopt;
  Secret secret(text.size() / 4 * 3, '\0');
  if (EVP_DecodeBlock(reinterpret_cast<unsigned char*>(secret.data()), raw(text), static_cast<int>(text.size())) < 0) {
    return std::nullopt;
  }
  secret.resize(secret.size() - static_cast<std::size_t>(std::count(text.end() - 2, text.end(), '=')));
  // Only the canonical encoding, so that equal secrets have equal texts.
  if (base64(secret) != text || secret.size() < bytes_min || secret.size() > bytes_max) return std::nullopt;
  return secret;
}

std::string hmac_sha256(const Secret& secret, std::string_view text) {
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned int size = 0;
  if (HMAC(EVP_sha256(), secret.data(), static_cast<int>(secret.size()), raw(text), text.size(), digest.data(),
           &size) == nullptr) {
    throw std::bad_alloc();
  }
  return {reinterpret_cast<const char*>(digest.data()), size};
}

}  // namespace

tracer::Result<std::vector<Secret>, std::string> read_secrets(const std::string& text) {
  std::vector<Secret> secrets;
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    auto secret = read_secret(word);
    if (!secret) return "secret " + std::to_string(secrets.size() + 1) + " is not whsec_ and 24 to 64 bytes in base64";
    secrets.push_back(*std::move(secret));
  }
  if (secrets.empty()) return std::string("there is no secret; one is whsec_ and 24 to 64 bytes in base64");
  return secrets;
}

std::string signature(const std::vector<Secret>& secrets, std::string_view id, std::int64_t timestamp_s,
                      std::string_view body) {
  std::string text(id);
  text.append(".").append(std::to_string(timestamp_s)).append(".").append(body);
  std::string value;
  for (const Secret& secret : secrets) {
    value += (value.empty() ? "v1," : " v1,") + base64(hmac_sha256(secret, text));
  }
  return value;
}

}  // namespace webhooks
