#pragma once
/// The daemon asked from outside, for machines without curl: what a container's health check runs.

#include <cstdint>
#include <string>

namespace http {

/// What /readyz of the health listener answers: "ready", or why not. `ready` is whether it said 200 within 3 s. A
/// wildcard address is asked on the loopback of its family.
struct Probe {
  bool ready = false;
  std::string answer;
};
Probe probe(const std::string& host, std::uint16_t port);

}  // namespace http
