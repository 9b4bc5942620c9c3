/// GET /v1/jobs/{id}/image.png and other artifacts, with ranges.

#include <algorithm>

#include "server/http/handlers/handlers.h"
#include "server/http/header_text.h"

namespace http::handlers {
namespace {

Problem image_not_found(const queue::Job& job, const std::string& name) {
  if (job.expired) return images_expired(job);
  if (job.state == queue::JobState::succeeded) {
    return {failures::image_not_found, "job " + job.id + " has no output " + name};
  }
  const std::string reason = queue::ended(job.state) ? "; it has no images" : "; its images exist once it succeeded";
  return {failures::image_not_found, "job " + job.id + " is " + queue::name_of(job.state) + reason};
}

/// Reduces the reply to the requested range (RFC 9110, section 14).
void apply_range(const Request& request, Reply& reply, const std::string& etag) {
  const auto condition = request.head.header("if-range");
  if (condition && *condition != etag) return;  // the client has a part of other bytes
  BodySource& source = *reply.source;
  const RangeAnswer answer = read_range(request.head.header("range"), source.size_bytes);
  const std::string size = std::to_string(source.size_bytes);
  if (answer.kind == RangeAnswer::Kind::unsatisfiable) {
    reply = problem_reply({failures::range_not_satisfiable, "the image has " + size + " bytes"}, request.id);
    reply.headers.emplace_back("Content-Range", "bytes */" + size);
  } else if (answer.kind == RangeAnswer::Kind::part) {
    const ByteRange range = answer.range;
    reply.status = 206;
    reply.headers.emplace_back(
        "Content-Range", "bytes " + std::to_string(range.begin) + '-' + std::to_string(range.end - 1) + '/' + size);
    source = {range.end - range.begin, [read = source.read, range](std::uint64_t at, char* into, std::size_t count) {
                return read(range.begin + at, into, std::min<std::uint64_t>(count, range.end - range.begin - at));
              }};
  }
}

}  // namespace

Answer get_image(Request& request, const ApiContext& context, const std::string& name) {
  const auto view = find_job(request.parameters.front(), context);
  if (!view) return view.error();
  const queue::Job& job = view->job;
  const auto artifact = std::find_if(job.artifacts.begin(), job.artifacts.end(),
                                     [&](const queue::Artifact& candidate) { return candidate.name == name; });
  if (artifact == job.artifacts.end()) return image_not_found(job, name);

  Reply reply = image_reply(job, *artifact, context);
  reply.headers.emplace_back("Cache-Control", "max-age=31536000, immutable");  // an image never changes
  reply.headers.emplace_back("Accept-Ranges", "bytes");
  const std::string etag = '"' + artifact->sha256 + '"';
  if (matches_etag(request.head.header("if-none-match"), etag)) {
    reply.status = 304;
    reply.content_type.clear();
    reply.source.reset();
  } else if (request.head.method == "GET") {  // Range is defined for GET only
    apply_range(request, reply, etag);
  }
  return reply;
}

}  // namespace http::handlers
