#pragma once
/// The handlers of the routes and their shared functions. A handler reads the request, calls the queue or a store, and
/// writes the reply.

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "api/reader/request.h"
#include "server/http/handlers/routes.h"
#include "server/queue/artifact_store.h"
#include "tracer/result.h"

namespace http::handlers {

using ContextHandler = Answer(Request&, const ApiContext&);
/// For routes of the job or batch {id}, which the handler gets. Without one it is not called.
using JobHandler = Answer(Request&, const queue::JobView&, const ApiContext&);
using BatchHandler = Answer(Request&, const queue::BatchState&, const ApiContext&);

/// A route with its handler, see Route. Each file of handlers lists its own.
struct Endpoint {
  std::string method, pattern;
  std::variant<ContextHandler*, JobHandler*, BatchHandler*> handler;
  RouteRules rules{};
};
using Endpoints = std::vector<Endpoint>;
Endpoints animation_endpoints(), asset_endpoints(), batch_endpoints(), bulk_endpoints(), compare_endpoints();
Endpoints event_endpoints(), image_endpoints(), job_endpoints(), page_endpoints(), service_endpoints();
Endpoints view_endpoints(), webhook_endpoints();

// ---- job_handlers.cpp
struct ListQuery {
  queue::JobFilter filter;
  std::string cursor;
  int limit = 50;
};
/// Reads the parameters of a list. The problem has the errors of all of them.
tracer::Result<ListQuery, Problem> read_list_query(const Pairs& pairs);

// ---- image_handlers.cpp
/// The reason why a job does not have this image.
Problem image_not_found(const queue::Job& job, const std::string& name);
/// Determines an image task, for ImageTasks. `images` has the SHA-256 of each image.
std::string key_of(const std::string& images, const queue::ImageWork& work);
/// The PNG that an earlier request had the worker make of an artifact; null if it is not kept.
ImageResult find_processed(const queue::Artifact& artifact, const queue::ImageWork& work, const ApiContext& context);
/// Calls `use` with the PNG that the worker makes of an artifact.
Answer process_image(const queue::Artifact& artifact, const queue::ImageWork& work, const ApiContext& context,
                     std::function<Answer(const ImageResult&)> use);
/// Replies with the PNG that the worker makes of an artifact of this job, or with the same from an earlier request.
Answer processed_image(const queue::Job& job, const queue::Artifact& artifact, const queue::ImageWork& work,
                       const ApiContext& context);

// ---- event_handlers.cpp
/// Reply to a submission: the first reply again if it was submitted before, 200 if the result was cached, 202 at once,
/// or with "Prefer: wait=N" 200 as soon as the job has ended and 202 after N seconds.
Answer submission_reply(const Request& request, const queue::Submitted& submitted, const ApiContext& context);

// ---- batch_handlers.cpp
/// The batch with this id. Problem: 404.
tracer::Result<queue::BatchState, Problem> find_batch(const std::string& id, const ApiContext& context);

/// The body of a reply that is produced while it is sent: size() bytes of read_piece(), which reads at least a byte.
template <class Pieces>
BodySource body_in_pieces(const std::shared_ptr<Pieces>& pieces) {
  return {pieces->size(), [pieces](std::uint64_t offset, char* into, std::size_t size) {
            std::size_t done = 0;
            while (done < size && offset + done < pieces->size())
              done += pieces->read_piece(offset + done, into + done, size - done);
            return done;
          }};
}

// ---- tar.cpp
/// A file of a tar archive (POSIX.1-1988, ustar).
struct TarEntry {
  std::string name;           ///< at most 100 bytes
  std::uint64_t bytes = 0;    ///< below 8 GiB, the limit of the format
  std::int64_t modified = 0;  ///< ms since 1970 UTC
  queue::Artifact artifact;
};
using OpenArtifact = std::function<std::unique_ptr<queue::ArtifactReader>(const queue::Artifact&)>;
/// The archive of stored artifacts as the body of a reply. It is produced while it is sent, and exists neither in
/// memory nor on disk. Opens one artifact at a time. An artifact that is missing or damaged cuts the reply short.
BodySource tar_of(std::vector<TarEntry> entries, OpenArtifact open);
/// The existing images of a batch, in its order. (batch_handlers.cpp)
std::vector<TarEntry> images_of(const std::string& batch, const ApiContext& context);

// ---- apng.cpp
using OpenFrame = std::function<std::unique_ptr<queue::ArtifactReader>(std::size_t index)>;
/// The images, which are PNG, as an endless animation that is produced while it is sent, as tar_of. None if they differ
/// in size, depth, color type or palette. Reads the headers of all chunks. Throws std::runtime_error if an image is
/// missing or no PNG.
std::optional<BodySource> apng_of(std::size_t images, OpenFrame open, int frames_per_second);

// ---- service_handlers.cpp
Answer get_overview(const Request& request);

// ---- submissions.cpp
/// A document, verbatim and parsed.
struct Scene {
  std::string document;
  api::Document parsed;
  api::Digests digests;
  api::SceneContent content;  ///< see api::content_of
};
/// Takes the body of a request that must be JSON; `other_type` is a second media type that it may have, `named_type`
/// one that the problem names. Problems: 411, 415.
tracer::Result<std::string, Problem> take_json(Request& request, std::string_view what,
                                               std::string_view other_type = {}, std::string_view named_type = {});
/// The problem of a refused body that is no scene document; see problem_of.
Problem request_problem(const api::Refusal& refusal);
/// Takes a body that is no scene document; `read` reads it, see api::read_body. Problems: 400, 411, 413, 415, 422.
template <class T>
tracer::Result<T, Problem> take_request(Request& request, std::string_view what, void (*read)(api::Reading&, T&),
                                        const api::Limits& limits) {
  const auto body = take_json(request, what);
  if (!body) return body.error();
  auto parsed = api::read_body<T>(*body, limits, read);
  if (!parsed) return request_problem(parsed.error());
  return *std::move(parsed);
}
/// The problem of bytes that exceed the limit of uploads.
Problem uploads_full(std::uint64_t bytes, const ApiContext& context);
/// Takes and parses the body of a request: a scene document, or a model with the media type model_type, which is kept
/// as an upload and becomes a document that stands for it. Problems: 400, 411, 413, 415, 422, 507.
inline constexpr std::string_view model_type = "model/gltf-binary";
tracer::Result<Scene, Problem> take_scene(Request& request, const ApiContext& context);
/// The problem of a valid scene that cannot be rendered here: missing files, or too much memory. `memory_bytes` is the
/// estimate of api/estimate.h, `at` the JSON pointer of the scene in the document.
std::optional<Problem> deployment_problem(const tracer::Scene& scene, std::uint64_t memory_bytes, const char* at,
                                          const ApiContext& context);
/// The owner, the request, and what the scene determines for jobs of all kinds.
queue::Submission submission_of(const Request& request, const tracer::Scene& scene, api::JobRequest wanted);
queue::Submission submission_of(const Request& request, Scene scene, const ApiContext& context);
/// The Idempotency-Key of the request, if it has one, for this body. Problem: 400.
tracer::Result<std::optional<queue::Idempotency>, Problem> idempotency_of(const Request& request,
                                                                          const std::string& body);
/// Submits a job under the Idempotency-Key of the request.
tracer::Result<queue::Submitted, Problem> submit(const Request& request, queue::Submission submission,
                                                 const ApiContext& context);

// ---- replies.cpp
const queue::Artifact* find_artifact(const queue::Job& job, std::string_view name);  ///< null if it has none
bool is_id(const std::string& text);  ///< has the form of queue::IdSource; other texts are not passed to the store
/// The job with this id. Problem: 404.
tracer::Result<queue::JobView, Problem> find_job(const std::string& id, const ApiContext& context);
/// ETag of a job: the revision, which If-Match compares, and a hash of the other fields. Weak: it excludes eta_s, which
/// changes with the clock, and rounds the progress down to hundredths, so that not every tile wakes waiting clients.
std::string etag_of(queue::JobView view);
Reply json_reply(int status, std::string body, const std::string& cache_control = {});  ///< empty: no such header
/// The job as JSON, with Location if the status is 202.
Reply job_reply(int status, const queue::JobView& view, const ApiContext& context);
Reply replayed_reply(const queue::FirstReply& first);
/// Sends the bytes of an artifact or asset as they are read from the store.
BodySource source_of(std::shared_ptr<const queue::ArtifactReader> reader);
/// The whole image.
tracer::Result<Reply, Problem> image_reply(const queue::Job& job, const queue::Artifact& artifact,
                                           const ApiContext& context);
/// Defers a reply until the job has ended or `deadline` has passed.
DeferredReply defer_until_ended(const std::string& id, Time deadline, const ApiContext& context,
                                std::function<Answer(bool timed_out)> resume);
/// A problem whose detail has the number of the errors. `where`: "in the document".
Problem with_errors(const Failure& failure, const std::string& where, std::vector<tracer::Issue> errors);
Problem problem_of(const api::Refusal& refusal);
Problem problem_of(const queue::Rejection& rejection);
Problem disk_full(const queue::DiskSpace& space);  ///< precondition: not enough
/// The reason why a job has no image. Precondition: failed or cancelled.
Problem problem_of(const queue::Job& job);
Problem job_not_found(const std::string& id);
Problem images_expired(const queue::Job& job);
Problem too_many_listeners(const ApiContext& context);
/// The problem of a request that changes the queue while the daemon drains; nothing otherwise.
std::optional<Problem> refuse_if_draining(const ApiContext& context);

}  // namespace http::handlers
