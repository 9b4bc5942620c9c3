#pragma once
/// The handlers behind the routes, one for each, and what they share. Each reads, calls, maps, writes.

#include <optional>
#include <string>

#include "server/http/routes.h"
#include "tracer/result.h"

namespace http {

// ---- job_handlers.cpp
Answer submit_job(Request& request, const Front& front);
Answer validate_job(Request& request, const Front& front);
Answer list_jobs(Request& request, const Front& front);
Answer get_job(Request& request, const Front& front);
Answer cancel_job(Request& request, const Front& front);
Answer remove_job(Request& request, const Front& front);
Answer get_deliveries(Request& request, const Front& front);

// ---- render_handler.cpp
Answer render(Request& request, const Front& front);

// ---- picture_handler.cpp
Answer get_picture(Request& request, const Front& front, const std::string& name);

// ---- asset_handlers.cpp
Answer find_missing_assets(Request& request, const Front& front);
Answer put_asset(Request& request, const Front& front);
Answer get_asset(Request& request, const Front& front);

// ---- service_handlers.cpp
Answer get_root(Request& request);
Answer get_version(Request& request, const Front& front);
Answer get_openapi(Request& request);

// ---- health_handlers.cpp
Answer get_liveness(Request& request);
Answer get_readiness(Request& request, const Health& health);
Answer get_metrics(Request& request, const Health& health);

// ---- shared
// ----------------------------------------------------------------------------------------------------------

/// A document as it came and as it was understood.
struct Scene {
  std::string document;
  api::Document parsed;
};
/// The problem of a request whose body is not JSON of a known length: 411 and 415.
std::optional<Problem> no_json_body(const Request& request, const char* what);

/// Takes the body of a request: 411, 415, 400, 413 and 422 come from here.
tracer::Result<Scene, Problem> take_scene(Request& request, const Front& front);

/// take_scene for a job that is to run: 503 while draining.
tracer::Result<Scene, Problem> take_work(Request& request, const Front& front);

/// The job that the path names; a problem when there is none.
tracer::Result<jobs::JobView, Problem> find_job(const Request& request, const Front& front);
Problem no_such_job(const std::string& id);

/// The job as JSON. With 202 it has Location.
Reply job_reply(int status, const jobs::JobView& view, const Front& front);

/// The whole picture, read from the store while it is sent.
Reply picture_reply(const jobs::Job& job, const jobs::Artifact& artifact, const Front& front);

}  // namespace http
