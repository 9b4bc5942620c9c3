#pragma once
/// Sends a POST to an untrusted server: limited in time and bytes, only to allowed addresses, without redirections.

#include <atomic>
#include <chrono>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "server/webhooks/networks.h"

namespace webhooks {

struct SenderSettings {
  Networks networks;  ///< allowed although they are not public
  std::chrono::milliseconds connect_timeout{5'000};
  std::chrono::milliseconds timeout{10'000};   ///< limit of the whole request
  std::size_t response_bytes_max = 64u << 10;  ///< headers included; the content is dropped
};

struct Response {
  int status = 0;      ///< HTTP status; 0 without a response
  std::string detail;  ///< the reason if there is none
};

class WebhookSender {
 public:
  explicit WebhookSender(SenderSettings settings);
  ~WebhookSender();
  WebhookSender(const WebhookSender&) = delete;
  WebhookSender& operator=(const WebhookSender&) = delete;

  using Headers = std::vector<std::pair<std::string, std::string>>;
  /// `url` is http or https. Connects to the address that was checked, even if the name resolves to another one later.
  /// Redirections are ordinary responses; proxies, cookies and credentials of the environment are not used. Ends early
  /// when `stop` is set. Throws only std::bad_alloc.
  [[nodiscard]] Response post(const std::string& url, const Headers& headers, const std::string& body,
                              const std::atomic<bool>& stop) const;

 private:
  SenderSettings settings_;
};

}  // namespace webhooks
