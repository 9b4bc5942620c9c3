#include <unistd.h>

#include <fstream>

#include "server/http/handlers.h"
#include "tracer/version.h"

namespace http {
namespace {

std::int64_t resident_bytes() {
  std::ifstream statm("/proc/self/statm");
  std::int64_t pages = 0, resident_pages = 0;
  statm >> pages >> resident_pages;
  return resident_pages * ::sysconf(_SC_PAGESIZE);
}

}  // namespace

/// The loop turns and a handler runs: that is what being alive means.
Answer get_liveness(Request&) {
  Reply reply;
  reply.content_type = "text/plain; charset=utf-8";
  reply.body = "alive\n";
  return reply;
}

Answer get_readiness(Request& request, const Health& health) {
  const std::string reason = health.not_ready();
  if (!reason.empty()) return problem_reply({Failure::not_ready, reason, {}}, request.id);
  Reply reply;
  reply.content_type = "text/plain; charset=utf-8";
  reply.body = "ready\n";
  return reply;
}

/// Prometheus text format 0.0.4.
Answer get_metrics(Request&, const Health& health) {
  using enum jobs::JobState;
  std::string text =
      "# HELP whittle_build_info Which program runs; always 1.\n# TYPE whittle_build_info gauge\n"
      "whittle_build_info{version=\"" +
      std::string(tracer::version()) + "\",build=\"" + std::string(tracer::build()) +
      "\"} 1\n"
      "# HELP whittle_jobs Jobs in the store, by state; queued ones are the queue's depth.\n"
      "# TYPE whittle_jobs gauge\n";
  for (const jobs::JobState state : {queued, running, succeeded, failed, cancelled}) {
    text += std::string("whittle_jobs{state=\"") + jobs::name_of(state) + "\"} " +
            std::to_string(health.job_count(state)) + "\n";
  }
  text +=
      "# HELP whittle_event_listeners Event streams and long polls.\n# TYPE whittle_event_listeners gauge\n"
      "whittle_event_listeners " +
      std::to_string(health.event_listeners()) + "\n";
  text +=
      "# HELP process_resident_memory_bytes Memory of the daemon, without its worker.\n"
      "# TYPE process_resident_memory_bytes gauge\nprocess_resident_memory_bytes " +
      std::to_string(resident_bytes()) + "\n";
  Reply reply;
  reply.content_type = "text/plain; version=0.0.4; charset=utf-8";
  reply.body = std::move(text);
  return reply;
}

}  // namespace http
