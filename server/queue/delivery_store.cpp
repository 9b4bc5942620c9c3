#include "server/queue/delivery_store.h"

#include <algorithm>

namespace queue {

const char* name_of(DeliveryState state) {
  switch (state) {
    case DeliveryState::pending:
      return "pending";
    case DeliveryState::delivered:
      return "delivered";
    case DeliveryState::abandoned:
      break;
  }
  return "abandoned";
}

std::string host_of(const std::string& url) {
  const std::size_t scheme_end = url.find("://");
  const std::size_t begin = scheme_end == std::string::npos ? 0 : scheme_end + 3;
  std::string receiver = url.substr(begin, url.find_first_of("/?#", begin) - begin);
  std::transform(receiver.begin(), receiver.end(), receiver.begin(),
                 [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
  return receiver;
}

}  // namespace queue
