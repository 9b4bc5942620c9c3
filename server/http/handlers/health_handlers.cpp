#include "server/http/handlers/handlers.h"

namespace http {

/// The loop turns and a handler runs: that is what being alive means.
Answer get_liveness(Request&) {
  Reply reply;
  reply.content_type = "text/plain; charset=utf-8";
  reply.body = "alive\n";
  return reply;
}

std::string Readiness::reason() {
  if (health_.draining()) return "draining";
  const std::lock_guard lock(mutex_);
  const auto now = std::chrono::steady_clock::now();
  if (!asked_ || now - *asked_ >= std::chrono::seconds(1)) {
    reason_ = health_.not_ready();
    asked_ = now;
  }
  return reason_;
}

Answer get_readiness(Request& request, Readiness& readiness) {
  const std::string reason = readiness.reason();
  if (!reason.empty()) return problem_reply({Failure::not_ready, reason, {}}, request.id);
  Reply reply;
  reply.content_type = "text/plain; charset=utf-8";
  reply.body = "ready\n";
  return reply;
}

/// Prometheus text format 0.0.4.
Answer get_metrics(Request&, const Health& health) {
  Reply reply;
  reply.content_type = "text/plain; version=0.0.4; charset=utf-8";
  reply.body = health.metrics();
  return reply;
}

}  // namespace http
