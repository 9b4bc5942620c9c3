#pragma once
/// A complete HTTP request, as handlers receive it.

#include <string>
#include <vector>

#include "server/http/body.h"
#include "server/http/request_head.h"

namespace http {

struct Request {
  std::string id;  ///< X-Request-Id of the reply and of every log line
  RequestHead head;
  Body body;
  std::string route;                    ///< the pattern that matched; empty if none did
  std::string owner;                    ///< name of the API key; empty without keys
  std::string remote;                   ///< address of the peer, from the socket
  std::vector<std::string> parameters;  ///< percent-decoded values of the {names} of the pattern, in order
};

}  // namespace http
