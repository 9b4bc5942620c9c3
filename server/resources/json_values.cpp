#include "server/resources/json_values.h"

#include <array>
#include <cstdio>
#include <ctime>

#include "api/validation_json.h"

namespace resources {

std::string text_of(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace) + '\n'; }

Json time_json(std::optional<std::int64_t> unix_ms) {
  if (!unix_ms) return nullptr;
  const std::time_t seconds = *unix_ms / 1000;
  std::tm utc{};
  gmtime_r(&seconds, &utc);
  std::array<char, 24> date{};
  std::strftime(date.data(), date.size(), "%Y-%m-%dT%H:%M:%S", &utc);
  std::array<char, 8> fraction{};
  std::snprintf(fraction.data(), fraction.size(), ".%03dZ", static_cast<int>(*unix_ms % 1000));
  return std::string(date.data()) + fraction.data();
}

Json errors_json(const std::vector<tracer::Issue>& errors) {
  Json list = Json::array();
  for (const tracer::Issue& issue : errors) {
    list.push_back({{"pointer", api::uri_fragment(issue.pointer)}, {"code", issue.code}, {"detail", issue.detail}});
  }
  return list;
}

}  // namespace resources
