#pragma once
/// One POST to somebody else's server, which is not trusted: within bounds of time and bytes, to addresses that are
/// allowed, following nothing. The only file of ours that speaks to libcurl is its .cpp.

#include <atomic>
#include <chrono>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "server/webhooks/networks.h"

namespace webhooks {

struct PosterSettings {
  Networks networks;  ///< that may be reached although they are not public
  std::chrono::milliseconds connect_timeout{5'000};
  std::chrono::milliseconds timeout{10'000};  ///< of all of it; receivers are to note the message and work later
  std::size_t answer_bytes_max = 64u << 10;   ///< heads included; nobody reads them
};

struct Answer {
  int status = 0;      ///< of HTTP; 0: none came
  std::string detail;  ///< then why, in words
};

class WebhookSender {
 public:
  explicit WebhookSender(PosterSettings settings);
  ~WebhookSender();
  WebhookSender(const WebhookSender&) = delete;
  WebhookSender& operator=(const WebhookSender&) = delete;

  using Headers = std::vector<std::pair<std::string, std::string>>;
  /// `url` is http or https. The address that is connected to is the one that was checked, whatever the name means a
  /// moment later. Redirections are answers like others; proxies, cookies and credentials of the environment are not
  /// used. Ends early when `stop` is set. Throws std::bad_alloc only.
  [[nodiscard]] Answer post(const std::string& url, const Headers& headers, const std::string& body,
                            const std::atomic<bool>& stop) const;

 private:
  PosterSettings settings_;
};

}  // namespace webhooks
