#pragma once
/// Times as text in JSON.

#include <cstdint>
#include <string>

namespace resources {

std::string time_text(std::int64_t unix_ms);  ///< RFC 3339 in UTC with milliseconds

}  // namespace resources
