#pragma once
/// Signs messages according to Standard Webhooks 1.0.0 (standardwebhooks.com, "Signature scheme"): HMAC-SHA256
/// (RFC 2104) over "id.timestamp.body", in base64 (RFC 4648), once for each secret, so that secrets can be rotated.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "tracer/result.h"

namespace webhooks {

using Secret = std::string;  ///< bytes

/// Parses secrets separated by white space, each "whsec_" and 24 to 64 bytes in base64. An error is a sentence without
/// any secret.
tracer::Result<std::vector<Secret>, std::string> read_secrets(const std::string& text);

/// The value of webhook-signature: "v1,..." for each secret, separated by spaces.
std::string signature(const std::vector<Secret>& secrets, std::string_view id, std::int64_t timestamp_s,
                      std::string_view body);

}  // namespace webhooks
