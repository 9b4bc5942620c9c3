#include "server/http/http_server.h"

#include <csignal>

#include "server/http/event_loop.h"

namespace http {

HttpServer::HttpServer(const HttpServerSettings& settings, std::vector<Route> routes,
                       std::function<std::string()> new_request_id, const telemetry::Log& log) {
  std::signal(SIGPIPE, SIG_IGN);  // writing to a disconnected client returns an error code
  loop_ = std::make_unique<EventLoop>(settings, std::move(routes), std::move(new_request_id), log);
}

HttpServer::~HttpServer() = default;

std::uint16_t HttpServer::port() const { return loop_->port(); }

std::size_t HttpServer::connections() const { return loop_->connections(); }

void HttpServer::drain(std::chrono::milliseconds grace) { loop_->drain(grace); }

}  // namespace http
