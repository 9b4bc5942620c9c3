#include <algorithm>

#include "server/http/handlers/handlers.h"
#include "server/http/negotiation.h"

namespace http {
namespace {

Problem no_image(const queue::Job& job, const std::string& name) {
  const std::string state = queue::name_of(job.state);
  if (job.expired) return {Failure::job_expired, "the images of job " + job.id + " are gone", {}};
  if (job.state == queue::JobState::succeeded) {
    return {Failure::image_not_found, "job " + job.id + " was not asked for " + name, {}};
  }
  const std::string ending =
      queue::ended(job.state) ? "; it has no images" : "; its images are there when it succeeded";
  return {Failure::image_not_found, "job " + job.id + " is " + state + ending, {}};
}

/// Cuts the reply down to the one range asked for (RFC 9110, section 14).
void apply_range(const Request& request, Reply& reply, const std::string& etag) {
  const auto condition = request.head.header("if-range");
  if (condition && *condition != etag) return;  // other bytes than the client has a part of
  BodySource& source = *reply.source;
  const RangeAnswer answer = read_range(request.head.header("range"), source.size_bytes);
  const std::string size = std::to_string(source.size_bytes);
  if (answer.kind == RangeAnswer::Kind::unsatisfiable) {
    reply = problem_reply({Failure::range_not_satisfiable, "the image has " + size + " bytes", {}}, request.id);
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

Answer get_image(Request& request, const ApiContext& front, const std::string& name) {
  const auto view = find_job(request, front);
  if (!view) return problem_reply(view.error(), request.id);
  const queue::Job& job = view->job;
  const auto artifact = std::find_if(job.artifacts.begin(), job.artifacts.end(),
                                     [&](const queue::Artifact& candidate) { return candidate.name == name; });
  if (artifact == job.artifacts.end()) return problem_reply(no_image(job, name), request.id);

  Reply reply = image_reply(job, *artifact, front);
  // A job's image never changes, so nobody need ask again.
  reply.headers.emplace_back("Cache-Control", "max-age=31536000, immutable");
  reply.headers.emplace_back("Accept-Ranges", "bytes");
  const std::string etag = '"' + artifact->sha256 + '"';
  const auto known = request.head.header("if-none-match");
  if (known && none_match_names(*known, etag)) {
    reply.status = 304;
    reply.content_type.clear();
    reply.source.reset();
  } else if (request.head.method == "GET") {  // Range means something for GET only
    apply_range(request, reply, etag);
  }
  return reply;
}

}  // namespace http
