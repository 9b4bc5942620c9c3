#include "server/http/probe.h"

#include <httplib.h>

namespace http {

Probe probe(const std::string& host, std::uint16_t port) {
  httplib::Client client(host == "0.0.0.0" ? "127.0.0.1" : host == "::" ? "::1" : host, port);
  client.set_connection_timeout(3);
  client.set_read_timeout(3);
  const httplib::Result result = client.Get("/readyz");
  if (!result) return {false, "no answer: " + httplib::to_string(result.error())};
  return {result->status == 200, result->body};
}

}  // namespace http
