#include <unistd.h>

#include <algorithm>
#include <fstream>

#include "server/http/handlers/handlers.h"
#include "server/telemetry/metric_registry.h"
#include "tracer/version.h"

namespace http {
namespace {

using telemetry::metric_head;
using telemetry::metric_line;

/// Of a process; nothing where there is none.
std::optional<double> resident_bytes(const std::string& process) {
  std::ifstream statm("/proc/" + process + "/statm");
  std::int64_t pages = 0, resident_pages = 0;
  if (!(statm >> pages >> resident_pages)) return std::nullopt;
  return static_cast<double>(resident_pages * ::sysconf(_SC_PAGESIZE));
}

std::string gauge(std::string_view name, std::string_view help, double value) {
  return metric_head(name, help, "gauge") + metric_line(name, {}, value);
}

std::string job_counts(const Health& health) {
  using enum queue::JobState;
  constexpr std::string_view name = "whittle_jobs";
  std::string text = metric_head(name, "Jobs in the store, by state; queued ones are the queue's depth.", "gauge");
  for (const queue::JobState state : {queued, running, succeeded, failed, cancelled}) {
    text += metric_line(name, {{"state", queue::name_of(state)}}, static_cast<double>(health.job_count(state)));
  }
  return text;
}

std::string memory(const Health& health) {
  std::string text;
  if (const auto bytes = resident_bytes("self")) {
    text += gauge("process_resident_memory_bytes", "Memory of the daemon, without its worker.", *bytes);
  }
  const int worker = health.worker_pid();
  const auto bytes = worker > 0 ? resident_bytes(std::to_string(worker)) : std::nullopt;
  if (bytes) text += gauge("whittle_worker_resident_memory_bytes", "Memory of the worker process.", *bytes);
  return text;
}

std::string kept(const Health& health) {
  constexpr std::string_view name = "whittle_cache_bytes";
  const KeptBytes kept = health.kept_bytes();
  return metric_head(name, "Memory that the worker keeps for later jobs, up to scene_cache_bytes together.", "gauge") +
         metric_line(name, {{"kind", "geometry"}}, static_cast<double>(kept.geometry)) +
         metric_line(name, {{"kind", "images"}}, static_cast<double>(kept.images));
}

std::string queue_age(const Health& health) {
  const auto oldest_at = health.oldest_at();
  const std::int64_t age_ms = oldest_at ? std::max<std::int64_t>(health.clock() - *oldest_at, 0) : 0;
  return gauge("whittle_queue_age_seconds", "How long the job that could run longest has waited; 0: none waits.",
               static_cast<double>(age_ms) / 1000);
}

std::string disk(const Health& health) {
  const queue::DiskSpace room = health.room();
  return gauge("whittle_disk_free_bytes", "Room on the data directory's disk.", static_cast<double>(room.free_bytes)) +
         gauge("whittle_disk_reserve_bytes", "With less room than this new jobs and uploads are refused.",
               static_cast<double>(room.reserve_bytes)) +
         gauge("whittle_upload_bytes", "Of all uploaded files together.", static_cast<double>(health.upload_bytes()));
}

}  // namespace

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
  constexpr std::string_view build = "whittle_build_info";
  Reply reply;
  reply.content_type = "text/plain; version=0.0.4; charset=utf-8";
  reply.body =
      metric_head(build, "Which program runs; always 1.", "gauge") +
      metric_line(build, {{"version", std::string(tracer::version())}, {"build", std::string(tracer::build())}}, 1) +
      job_counts(health) + queue_age(health) + disk(health) +
      gauge("whittle_connections", "Open connections of clients.", static_cast<double>(health.connections())) +
      gauge("whittle_event_listeners", "Event streams and long polls.", static_cast<double>(health.event_listeners())) +
      memory(health) + kept(health) + health.figures();
  return reply;
}

}  // namespace http
