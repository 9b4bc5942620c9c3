#pragma once
/// The handlers behind the routes, one for each, and what they share. Each reads, calls, maps, writes.

#include <optional>
#include <string>
#include <vector>

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

// ---- job_change_handlers.cpp
Answer retry_job(Request& request, const Front& front);
Answer change_job(Request& request, const Front& front);
Answer get_queue(Request& request, const Front& front);

// ---- batch_handlers.cpp
Answer submit_batch(Request& request, const Front& front);
Answer get_batch(Request& request, const Front& front);
Answer cancel_batch(Request& request, const Front& front);
Answer retry_batch(Request& request, const Front& front);
Answer get_batch_artifacts(Request& request, const Front& front);

// ---- render_handler.cpp
Answer render(Request& request, const Front& front);

// ---- picture_handler.cpp
Answer get_picture(Request& request, const Front& front, const std::string& name);

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
  std::string canonical;  ///< see api::parse_scene
};
/// The body of a request that must be JSON: 411 and 415 come from here.
tracer::Result<std::string, Problem> take_json(Request& request, std::string_view what);
/// Takes the body of a request: 411, 415, 400, 413 and 422 come from here.
tracer::Result<Scene, Problem> take_scene(Request& request, const Front& front);

/// What of a good scene cannot be rendered here: files that are not there, more memory than a job may take.
std::vector<tracer::Issue> refused_here(const tracer::Scene& scene, const Front& front);

/// take_scene for a job that is to run: 503 while draining.
tracer::Result<Scene, Problem> take_work(Request& request, const Front& front);

/// The scene as the queue takes it.
jobs::Submission submission_of(const Request& request, Scene scene, const Front& front);
/// The wish of the request's Idempotency-Key, for this body; nothing where it has none, 400 when that is none.
tracer::Result<std::optional<jobs::Idempotency>, Problem> idempotency_of(const Request& request,
                                                                         const std::string& body, const Front& front);
/// The first reply once more.
Reply replayed_reply(const jobs::FirstReply& first);

bool is_id(const std::string& text);  ///< as jobs::IdSource writes them: nothing else reaches the store

/// The job that the path names; a problem when there is none.
tracer::Result<jobs::JobView, Problem> find_job(const Request& request, const Front& front);
Problem no_such_job(const std::string& id);

/// Its ETag: the revision first, so that If-Match can hold against progress, then a hash of `body`, so that
/// If-None-Match sees progress too.
std::string etag_of(const jobs::Job& job, const std::string& body);
/// The revision that If-Match names; nothing where it names any ("*"). A problem where there is none or it is no ETag
/// of a job.
tracer::Result<std::optional<std::int64_t>, Problem> revision_asked_for(const Request& request);

/// The job as JSON. With 202 it has Location.
Reply job_reply(int status, const jobs::JobView& view, const Front& front);

/// The whole picture, read from the store while it is sent.
Reply picture_reply(const jobs::Job& job, const jobs::Artifact& artifact, const Front& front);

}  // namespace http
