/// The routes of the health listener: liveness, readiness, metrics.

#include "server/http/handlers/handlers.h"

namespace http::handlers {
namespace {

Reply text_reply(std::string body) {
  Reply reply;
  reply.content_type = "text/plain; charset=utf-8";
  reply.body = std::move(body);
  return reply;
}

}  // namespace

/// The daemon is alive if the event loop and the handlers run.
Answer get_liveness(Request&) { return text_reply("alive\n"); }

std::string Readiness::reason() {
  if (health_.draining()) return "draining";
  const std::lock_guard lock(mutex_);
  const auto now = std::chrono::steady_clock::now();
  if (!probed_at_ || now - *probed_at_ >= std::chrono::seconds(1)) {
    reason_ = health_.not_ready();
    probed_at_ = now;
  }
  return reason_;
}

Answer get_readiness(Readiness& readiness) {
  const std::string reason = readiness.reason();
  if (!reason.empty()) return Problem{failures::not_ready, reason};
  return text_reply("ready\n");
}

/// Prometheus text format 0.0.4.
Answer get_metrics(const Health& health) {
  Reply reply;
  reply.content_type = "text/plain; version=0.0.4; charset=utf-8";
  reply.body = health.metrics();
  return reply;
}

}  // namespace http::handlers
