#pragma once
/// Signature Version 4 in the query of a URL, which libcurl does not make. Private to server/storage/s3.

#include <chrono>
#include <ctime>
#include <string>

#include "server/storage/s3/s3_credentials.h"
#include "server/storage/s3/s3_http.h"

namespace storage::s3 {

/// `url` without a query, signed for GET from `now` on for `seconds` (at most a week).
std::string presigned(const std::string& url, const std::string& region, const Credentials& credentials,
                      std::chrono::seconds seconds, std::time_t now, Parameters parameters);

}  // namespace storage::s3
