#pragma once
/// The handlers behind the routes, one for each, and what they share. Each reads, calls, maps, writes.

#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "server/http/handlers/routes.h"
#include "tracer/result.h"

namespace http {

// ---- job_handlers.cpp
Answer submit_job(Request& request, const ApiContext& front);
Answer validate_job(Request& request, const ApiContext& front);
Answer list_jobs(Request& request, const ApiContext& front);
Answer cancel_job(Request& request, const ApiContext& front);
Answer remove_job(Request& request, const ApiContext& front);
Answer get_deliveries(Request& request, const ApiContext& front);

// ---- job_change_handlers.cpp
Answer retry_job(Request& request, const ApiContext& front);
Answer change_job(Request& request, const ApiContext& front);
Answer get_queue(Request& request, const ApiContext& front);

// ---- batch_handlers.cpp
Answer submit_batch(Request& request, const ApiContext& front);
Answer get_batch(Request& request, const ApiContext& front);
Answer cancel_batch(Request& request, const ApiContext& front);
Answer retry_batch(Request& request, const ApiContext& front);
Answer get_batch_artifacts(Request& request, const ApiContext& front);

// ---- measure_handler.cpp
Answer measure(Request& request, const ApiContext& front);

// ---- preview_handler.cpp
Answer get_preview(Request& request, const ApiContext& front);

// ---- render_handler.cpp
Answer render(Request& request, const ApiContext& front);

// ---- job_waiting.cpp
Answer get_job(Request& request, const ApiContext& front);
/// The answer to a submission: the first one again when it was one before, 200 when the images were there, else 202
/// at once, or when "Prefer: wait=N" asks for it 200 once the job has ended.
Answer submission_reply(const Request& request, const queue::Submitted& submitted, const ApiContext& front);

// ---- event_handlers.cpp
Answer get_job_events(Request& request, const ApiContext& front);
Answer get_events(Request& request, const ApiContext& front);

// ---- image_handler.cpp
Answer get_image(Request& request, const ApiContext& front, const std::string& name);

// ---- asset_handlers.cpp
Answer find_missing_assets(Request& request, const ApiContext& front);
Answer put_asset(Request& request, const ApiContext& front);
Answer get_asset(Request& request, const ApiContext& front);

// ---- service_handlers.cpp
Answer get_root(Request& request);
Answer get_version(Request& request, const ApiContext& front);
Answer get_openapi(Request& request);
Answer get_docs(Request& request);

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

// ---- domain_problems.cpp
Problem problem_of(const api::Refusal& refusal);
Problem problem_of(const queue::Rejection& rejection);
Problem disk_full(const queue::DiskSpace& space);  ///< Precondition: not enough
/// The reason why a job has no image. Precondition: failed or cancelled.
Problem problem_of(const queue::Job& job);

// ---- shared

/// A document as it came and as it was understood.
struct Scene {
  std::string document;
  api::Document parsed;
  std::string canonical;  ///< see api::parse_scene
};
/// The body of a request that must be JSON: 411 and 415 come from here.
tracer::Result<std::string, Problem> take_json(Request& request, std::string_view what);
/// Takes the body of a request: 411, 415, 400, 413 and 422 come from here.
tracer::Result<Scene, Problem> take_scene(Request& request, const ApiContext& front);

/// What of a good scene cannot be rendered here: files that are not there, more memory than a job may take.
/// `memory_bytes` as estimated (api/estimate.h).
std::vector<tracer::Issue> refused_here(const tracer::Scene& scene, std::uint64_t memory_bytes,
                                        const ApiContext& front);

/// take_scene for a job that is to run: 503 while draining.
tracer::Result<Scene, Problem> take_work(Request& request, const ApiContext& front);

/// The scene as the queue takes it.
queue::Submission submission_of(const Request& request, Scene scene, const ApiContext& front);
/// The wish of the request's Idempotency-Key, for this body; nothing where it has none, 400 when that is none.
tracer::Result<std::optional<queue::Idempotency>, Problem> idempotency_of(const Request& request,
                                                                          const std::string& body,
                                                                          const ApiContext& front);
/// Has the submission done once, and its reply kept, where the request wishes so.
void do_once(queue::Submission& submission, std::optional<queue::Idempotency> idempotency, const ApiContext& front);
/// The first reply once more.
Reply replayed_reply(const queue::FirstReply& first);

bool is_id(const std::string& text);  ///< as queue::IdSource writes them: nothing else reaches the store

/// The job that the path names; a problem when there is none.
tracer::Result<queue::JobView, Problem> find_job(const Request& request, const ApiContext& front);
Problem no_such_job(const std::string& id);
Problem too_many_listeners(const ApiContext& front);

/// Its ETag: the revision first, which If-Match is held against, then what tells any two states apart. Weak: what only
/// the clock changes (eta_s) is left out, and progress counts by the hundredth, so that who waits for a change is not
/// woken by every tile.
std::string etag_of(queue::JobView view);
/// The revision that If-Match names; nothing where it names any ("*"). A problem where there is none or it is no ETag
/// of a job.
tracer::Result<std::optional<std::int64_t>, Problem> revision_asked_for(const Request& request);

/// The job as JSON. With 202 it has Location.
Reply job_reply(int status, const queue::JobView& view, const ApiContext& front);

/// The whole image, read from the store while it is sent.
Reply image_reply(const queue::Job& job, const queue::Artifact& artifact, const ApiContext& front);

}  // namespace http
