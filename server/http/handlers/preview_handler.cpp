/// GET /v1/jobs/{id}/preview: the image so far. Waiting occupies no thread.

#include <algorithm>

#include "server/http/handlers/handlers.h"
#include "server/http/header_text.h"

namespace http::handlers {
namespace {

constexpr std::uint32_t side_default = 512, side_min = 16;

/// Longest wait for a new preview; a later one serves the next request.
constexpr std::chrono::seconds preview_wait{2};

/// The parameter max; nothing if it is invalid.
std::optional<std::uint32_t> read_side(const Pairs& query) {
  if (query.empty()) return side_default;
  const auto side = parse_number<std::uint32_t>(query.front().second);
  const bool valid = query.size() == 1 && side && *side >= side_min && *side <= queue::preview_side_max;
  return valid ? side : std::nullopt;
}

struct PreviewQuery {
  std::string id;
  std::optional<std::string> if_none_match;
  std::uint32_t side = side_default;
};

/// Redirects to the PNG image of a job that has ended.
Answer redirect_to_image(const queue::Job& job) {
  if (job.expired) return images_expired(job);
  const auto png = std::find_if(job.artifacts.begin(), job.artifacts.end(),
                                [](const queue::Artifact& artifact) { return artifact.media_type == "image/png"; });
  if (png == job.artifacts.end()) {
    const std::string reason = job.artifacts.empty() ? "; it has no images" : ", and not as PNG";
    return Problem{failures::image_not_found, "job " + job.id + " is " + queue::name_of(job.state) + reason};
  }
  Reply reply;
  reply.status = 303;
  reply.headers = {{"Location", "/v1/jobs/" + job.id + "/" + png->name}, {"Cache-Control", "no-cache"}};
  reply.job_id = job.id;
  return reply;
}

/// The latest preview, without waiting.
Answer latest_preview(const PreviewQuery& query, const ApiContext& context) {
  const auto view = find_job(query.id, context);
  if (!view) return view.error();
  if (queue::ended(view->job.state)) return redirect_to_image(view->job);
  const queue::Previews::Latest latest = context.queue.waiters.preview(query.id, query.side);
  Reply reply;
  reply.job_id = query.id;
  if (!latest.png) {
    reply.status = 204;
    reply.headers.emplace_back("Cache-Control", "no-store");
    return reply;
  }
  const std::string etag = '"' + context.sha256(*latest.png) + '"';
  reply.headers = {{"ETag", etag}, {"Cache-Control", "no-cache"}};
  if (matches_etag(query.if_none_match, etag)) {
    reply.status = 304;
    return reply;
  }
  reply.content_type = "image/png";
  reply.body = *latest.png;
  return reply;
}

}  // namespace

Answer get_preview(Request& request, const ApiContext& context) {
  const auto side = read_side(request.head.query);
  if (!side) {
    const std::string range = std::to_string(side_min) + ".." + std::to_string(queue::preview_side_max);
    return Problem{failures::invalid_query, "max must be given once, as a whole number " + range};
  }
  const auto view = find_job(request.parameters.front(), context);
  if (!view) return view.error();
  PreviewQuery query{view->job.id, {}, *side};
  if (const auto if_none_match = request.head.header("if-none-match")) query.if_none_match = *if_none_match;
  queue::JobWaiters& waiters = context.queue.waiters;
  const bool traced = view->job.state == queue::JobState::running && view->job.kind == queue::JobKind::render;
  if (!traced || waiters.preview(query.id, query.side).fresh) return latest_preview(query, context);

  const auto watch = [&waiters, query](std::function<void()> notify) -> std::function<void()> {
    const std::uint64_t token = waiters.request_preview(query.id, query.side, std::move(notify));
    return [&waiters, token] { waiters.cancel_preview(token); };
  };
  const auto resume = [&context, query](bool) { return latest_preview(query, context); };
  return DeferredReply{std::chrono::steady_clock::now() + preview_wait, watch, resume};
}

}  // namespace http::handlers
