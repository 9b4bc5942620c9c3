#pragma once
/// Readiness probe over HTTP, for the health check of a container without curl.

#include <cstdint>
#include <string>

namespace http {

/// Reply of /readyz of the health listener: "ready", or the reason why it is not. `ready`: it was 200 within 3 s.
struct Probe {
  bool ready = false;
  std::string answer;
};
/// `host` is the listen address; a wildcard address is probed on the loopback address of its family.
Probe probe(const std::string& host, std::uint16_t port);

}  // namespace http
