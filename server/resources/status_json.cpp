#include <nlohmann/json.hpp>

#include "server/resources/resource_json.h"

namespace resources {
namespace {

using Json = nlohmann::ordered_json;

template <class Value>
Json or_null(const std::optional<Value>& value) {
  return value ? Json(*value) : Json(nullptr);
}

Json workers_json(const ServiceStatus& status) {
  const telemetry::GaugeValues& now = status.gauges;
  if (now.worker_pid == 0) return Json::array();
  return Json::array({{{"pid", now.worker_pid},
                       {"jobs", now.worker_jobs},
                       {"places", now.worker_slots},
                       {"rss_bytes", or_null(now.worker_rss_bytes)},
                       {"sandbox", status.sandbox.empty() ? Json(nullptr) : Json(status.sandbox)}}});
}

Json history_json(const telemetry::ServiceHistory::Hour& hour) {
  using Step = telemetry::ServiceHistory::Step;
  const auto series = [&](auto member) {
    Json values = Json::array();
    for (const Step& step : hour.steps) {
      if constexpr (requires { (step.*member).has_value(); }) {
        values.push_back(or_null(step.*member));
      } else {
        values.push_back(step.*member);
      }
    }
    return values;
  };
  return {{"step_s", telemetry::ServiceHistory::step_ms / 1000},
          {"until", hour.until == 0 ? Json(nullptr) : Json(time_text(hour.until))},
          {"queued", series(&Step::queued)},
          {"running", series(&Step::running)},
          {"ended", series(&Step::ended)},
          {"failed", series(&Step::failed)},
          {"wait_p50_ms", series(&Step::wait_p50_ms)},
          {"wait_p95_ms", series(&Step::wait_p95_ms)},
          {"rays", series(&Step::rays)},
          {"rss_bytes", series(&Step::rss_bytes)}};
}

}  // namespace

std::string write_status(const ServiceStatus& status) {
  const telemetry::GaugeValues& now = status.gauges;
  Json limits = Json::object();
  for (const auto& [name, value] : status.limits) limits[name] = value;
  limits["artifact_bytes"] = now.artifact_bytes_max;
  const Json json{
      {"ready", status.not_ready.empty()},
      {"reason", status.not_ready},
      {"draining", status.draining},
      {"workers", workers_json(status)},
      {"disk", {{"free_bytes", now.disk_space.free_bytes}, {"reserve_bytes", now.disk_space.reserve_bytes}}},
      {"memory", {{"rss_bytes", or_null(now.rss_bytes)}}},
      {"caches", {{"geometry_bytes", now.cache_geometry_bytes}, {"image_bytes", now.cache_image_bytes}}},
      {"queue", Json::parse(write_queue(status.queue))},
      {"streams", {{"open", now.event_listeners}, {"limit", status.streams_max}}},
      {"version", {{"version", now.version}, {"build", now.build}}},
      {"limits", std::move(limits)},
      {"used",
       {{"queued_jobs", status.queue.jobs.at(queue::JobState::queued)},
        {"artifact_bytes", now.artifact_bytes},
        {"uploads_bytes", now.upload_bytes}}},
      {"history", status.hour ? history_json(*status.hour) : Json(nullptr)}};
  return json.dump(-1, ' ', false, Json::error_handler_t::replace) + '\n';
}

}  // namespace resources
