#pragma once
/// The handlers behind the routes, one for each, and what they share. Each reads, calls, maps, writes.

#include <mutex>
#include <optional>
#include <string>

#include "server/http/routes.h"
#include "tracer/result.h"

namespace http {

// ---- job_handlers.cpp
Answer submit_job(Request& request, const Front& front);
Answer validate_job(Request& request, const Front& front);
Answer list_jobs(Request& request, const Front& front);
Answer cancel_job(Request& request, const Front& front);
Answer remove_job(Request& request, const Front& front);

// ---- render_handler.cpp
Answer render(Request& request, const Front& front);

// ---- job_waiting.cpp
Answer get_job(Request& request, const Front& front);
/// The answer to a submission: 202 at once, or when "Prefer: wait=N" asks for it 200 once the job has ended.
Answer submission_reply(const Request& request, const jobs::JobView& submitted, const Front& front);

// ---- event_handlers.cpp
Answer get_job_events(Request& request, const Front& front);
Answer get_events(Request& request, const Front& front);

// ---- picture_handler.cpp
Answer get_picture(Request& request, const Front& front, const std::string& name);

// ---- service_handlers.cpp
Answer get_root(Request& request);
Answer get_version(Request& request, const Front& front);
Answer get_openapi(Request& request);

// ---- health_handlers.cpp
Answer get_liveness(Request& request);
/// Whether jobs would run now. To find out costs a durable write, so it is looked at once a second at most.
class Readiness {
 public:
  explicit Readiness(Health health) : health_(std::move(health)) {}
  std::string reason();  ///< empty: ready

 private:
  const Health health_;
  std::mutex mutex_;
  std::optional<std::chrono::steady_clock::time_point> asked_;
  std::string reason_;
};
Answer get_readiness(Request& request, Readiness& readiness);
Answer get_metrics(Request& request, const Health& health);

// ---- shared
// ----------------------------------------------------------------------------------------------------------

/// A document as it came and as it was understood.
struct Scene {
  std::string document;
  api::Document parsed;
};
/// Takes the body of a request: 411, 415, 400, 413 and 422 come from here.
tracer::Result<Scene, Problem> take_scene(Request& request, const Front& front);

/// take_scene for a job that is to run: 503 while draining.
tracer::Result<Scene, Problem> take_work(Request& request, const Front& front);

/// The job that the path names; a problem when there is none.
tracer::Result<jobs::JobView, Problem> find_job(const Request& request, const Front& front);
Problem no_such_job(const std::string& id);
Problem too_many_listeners(const Front& front);

/// The job as JSON. With 202 it has Location.
Reply job_reply(int status, const jobs::JobView& view, const Front& front);

/// The whole picture, read from the store while it is sent.
Reply picture_reply(const jobs::Job& job, const jobs::Artifact& artifact, const Front& front);

}  // namespace http
