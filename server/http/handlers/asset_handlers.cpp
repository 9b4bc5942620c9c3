/// Uploaded files, named by the sha256 of their bytes.

#include "api/asset_requests.h"
#include "server/http/handlers/handlers.h"
#include "server/http/negotiation.h"

namespace http {
namespace {

Reply json_reply(int status, std::string body) {
  Reply reply;
  reply.status = status;
  reply.content_type = "application/json";
  reply.body = std::move(body);
  return reply;
}

Problem no_such_asset(const std::string& sha256) {
  if (!api::is_asset_hash(sha256)) {
    return {Failure::asset_not_found, "assets are named by 64 lower-case hex digits", {}};
  }
  return {Failure::asset_not_found, "there is no asset " + sha256 + "; PUT brings it", {}};
}

}  // namespace

/// What is there counts as used: it stays long enough for the job that the client is about to send.
Answer find_missing_assets(Request& request, const ApiContext& front) {
  const auto body = take_json(request, "the hashes");
  if (!body) return problem_reply(body.error(), request.id);
  const auto hashes = api::parse_asset_hashes(*body, front.limits.document);
  if (!hashes) {
    Problem problem = problem_of(hashes.error());
    if (problem.failure == Failure::bad_scene) problem.failure = Failure::invalid_request;
    return problem_reply(problem, request.id);
  }
  std::vector<std::string> missing;
  for (const std::string& sha256 : *hashes) {
    if (!front.assets.use(sha256)) missing.push_back(sha256);
  }
  return json_reply(200, api::write_missing(missing));
}

Answer put_asset(Request& request, const ApiContext& front) {
  if (!request.head.content_length) {
    return problem_reply({Failure::length_required, "send the file with its Content-Length", {}}, request.id);
  }
  if (const queue::DiskSpace room = front.room(); room.state != queue::DiskSpace::State::enough) {
    return problem_reply(disk_full(room), request.id);
  }
  const std::string& sha256 = request.parameters.front();
  const auto read = [&](std::uint64_t offset, char* into, std::size_t size) {
    return request.body.read(offset, into, size);
  };
  const queue::AssetStore::Put put = front.assets.put(sha256, read);
  if (put == queue::AssetStore::Put::other_bytes) {
    const std::string detail = "the " + std::to_string(request.body.size_bytes()) +
                               " bytes have another sha256 than the path; nothing was stored";
    return problem_reply({Failure::asset_mismatch, detail, {}}, request.id);
  }
  if (put == queue::AssetStore::Put::no_room) {
    const std::string detail = "uploads have " + std::to_string(front.assets.bytes()) + " bytes, with these " +
                               std::to_string(request.body.size_bytes()) +
                               " they would have more than the limit uploads_bytes; nothing was stored";
    return problem_reply({Failure::uploads_full, detail, {}}, request.id);
  }
  const bool is_new = put == queue::AssetStore::Put::stored;
  Reply reply = json_reply(is_new ? 201 : 200, api::write_asset(sha256, request.body.size_bytes()));
  if (is_new) reply.headers.emplace_back("Location", "/v1/assets/" + sha256);
  return reply;
}

Answer get_asset(Request& request, const ApiContext& front) {
  const std::string& sha256 = request.parameters.front();
  const std::shared_ptr<const queue::ArtifactReader> reader = front.assets.open(sha256);
  if (!reader) return problem_reply(no_such_asset(sha256), request.id);
  const std::string etag = '"' + sha256 + '"';
  Reply reply;
  reply.headers.emplace_back("ETag", etag);
  reply.headers.emplace_back("Cache-Control", "max-age=31536000, immutable");
  const auto known = request.head.header("if-none-match");
  if (known && none_match_names(*known, etag)) {
    reply.status = 304;
    return reply;
  }
  reply.content_type = "application/octet-stream";
  reply.source = BodySource{reader->size_bytes(), [reader](std::uint64_t offset, char* into, std::size_t size) {
                              return reader->read(offset, into, size);
                            }};
  return reply;
}

}  // namespace http
