/// GET /v1/jobs/{id}/preview: an image as far as it is. Waiting for it holds no thread.

#include <algorithm>
#include <charconv>

#include "server/http/handlers/handlers.h"
#include "server/http/negotiation.h"

namespace http {
namespace {

constexpr std::uint32_t side_default = 512, side_min = 16;

/// For the one that is asked for now; what comes later is there for the next who asks.
constexpr std::chrono::seconds patience{2};

/// Of the query; nothing when it is no such number.
std::optional<std::uint32_t> read_side(const Pairs& query) {
  if (query.empty()) return side_default;
  std::uint32_t side = 0;
  const std::string& text = query.front().second;
  const char* const end = text.data() + text.size();
  const auto [stop, error] = std::from_chars(text.data(), end, side);
  const bool good = error == std::errc{} && stop == end && query.size() == 1;
  return good && side >= side_min && side <= queue::preview_side_max ? std::optional(side) : std::nullopt;
}

struct Asked {
  std::string id, request_id;
  std::optional<std::string> known;  ///< the If-None-Match
  std::uint32_t side = side_default;
};

Reply nothing_yet(const Asked& asked) {
  Reply reply;
  reply.status = 204;
  reply.headers.emplace_back("Cache-Control", "no-store");
  reply.job_id = asked.id;
  return reply;
}

Reply preview_reply(const Asked& asked, const std::string& png, const ApiContext& front) {
  const std::string etag = '"' + front.sha256(png) + '"';
  Reply reply;
  reply.headers = {{"ETag", etag}, {"Cache-Control", "no-cache"}};
  reply.job_id = asked.id;
  if (asked.known && none_match_names(*asked.known, etag)) {
    reply.status = 304;
    return reply;
  }
  reply.content_type = "image/png";
  reply.body = png;
  return reply;
}

/// Of a job that has ended: where its image is, if it is one that browsers show.
Reply reply_for_ended(const Asked& asked, const queue::Job& job) {
  if (job.expired) {
    return problem_reply({Failure::job_expired, "the images of job " + job.id + " are gone", {}}, asked.request_id);
  }
  const auto png = std::find_if(job.artifacts.begin(), job.artifacts.end(),
                                [](const queue::Artifact& artifact) { return artifact.media_type == "image/png"; });
  if (png == job.artifacts.end()) {
    const std::string why = job.artifacts.empty() ? "; it has no images" : ", and not as PNG";
    return problem_reply({Failure::image_not_found, "job " + job.id + " is " + queue::name_of(job.state) + why, {}},
                         asked.request_id);
  }
  Reply reply;
  reply.status = 303;
  reply.headers = {{"Location", "/v1/jobs/" + job.id + "/" + png->name}, {"Cache-Control", "no-cache"}};
  reply.job_id = job.id;
  return reply;
}

Reply reply_now(const Asked& asked, const ApiContext& front) {
  const auto view = front.queue.queries.find(asked.id);
  if (!view) return problem_reply(no_such_job(asked.id), asked.request_id);
  if (queue::ended(view->job.state)) return reply_for_ended(asked, view->job);
  const queue::Previews::Latest latest = front.queue.waiters.preview(asked.id, asked.side);
  return latest.png ? preview_reply(asked, *latest.png, front) : nothing_yet(asked);
}

}  // namespace

Answer get_preview(Request& request, const ApiContext& front) {
  const auto side = read_side(request.head.query);
  if (!side) {
    const std::string range = std::to_string(side_min) + ".." + std::to_string(queue::preview_side_max);
    return problem_reply({Failure::bad_query, "max must be a whole number " + range + ", once", {}}, request.id);
  }
  const auto view = find_job(request, front);
  if (!view) return problem_reply(view.error(), request.id);
  Asked asked{view->job.id, request.id, {}, *side};
  if (const auto known = request.head.header("if-none-match")) asked.known = *known;
  const bool traced = view->job.state == queue::JobState::running && view->job.kind == queue::JobKind::render;
  if (!traced || front.queue.waiters.preview(asked.id, asked.side).fresh) return reply_now(asked, front);

  const auto watch = [front, asked](std::function<void()> wake) -> std::function<void()> {
    const std::uint64_t token = front.queue.waiters.request_preview(asked.id, asked.side, std::move(wake));
    return [front, token] { front.queue.waiters.cancel_preview(token); };
  };
  const auto resume = [front, asked](bool) -> Answer { return reply_now(asked, front); };
  return DeferredReply{std::chrono::steady_clock::now() + patience, watch, resume};
}

}  // namespace http
