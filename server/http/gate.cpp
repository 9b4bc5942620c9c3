#include "server/http/gate.h"

#include <csignal>

#include "server/http/gate_loop.h"

namespace http {

Gate::Gate(const GateSettings& settings, const std::vector<Route>& routes, std::function<std::string()> new_request_id,
           const telemetry::Log& log) {
  std::signal(SIGPIPE, SIG_IGN);  // a client that leaves is an error code, not a signal
  loop_ = std::make_unique<Loop>(settings, routes, std::move(new_request_id), log);
}

Gate::~Gate() = default;

std::uint16_t Gate::port() const { return loop_->port(); }

std::size_t Gate::connections() const { return loop_->connections(); }

void Gate::drain(std::chrono::milliseconds grace) { loop_->drain(grace); }

}  // namespace http
