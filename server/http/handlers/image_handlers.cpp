/// Images of jobs: POST /v1/render, image.png and other artifacts with ranges, and previews. Waiting occupies no
/// thread.

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "api/report.h"
#include "server/http/handlers/handlers.h"
#include "server/http/header_text.h"
#include "tracer/encode.h"
#include "tracer/sha256.h"

namespace http::handlers {
namespace {

/// Reduces the reply to the requested range (RFC 9110, section 14), which is for a client without the image.
void apply_range(const Request& request, Reply& reply, const std::string& etag) {
  if (request.head.method != "GET" || none_match_names(request.head.header("if-none-match"), etag)) return;
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

/// The format that Accept prefers among those of the document, in its order, followed by all others that can hold the
/// image.
std::optional<tracer::Format> accepted_format(const Request& request, const tracer::Scene& scene) {
  const tracer::PixelWindow window = scene.image.window();
  std::vector<tracer::Format> formats = scene.output.formats;
  for (const tracer::Format format : tracer::all_formats) {
    const bool holds_image = std::max(window.width(), window.height()) <= tracer::row(format).side_max;
    if (holds_image && std::ranges::find(formats, format) == formats.end()) formats.push_back(format);
  }
  std::vector<std::string_view> types;
  for (const tracer::Format format : formats) types.push_back(tracer::row(format).media_type);
  const auto best = best_offer(request.head.header("accept"), types);
  return best ? std::optional(formats[*best]) : std::nullopt;
}

/// Adds an accepted format to the outputs of the document.
void add_format(Scene& scene, tracer::Format format) {
  auto& formats = scene.parsed.scene.output.formats;
  if (std::ranges::find(formats, format) != formats.end()) return;
  scene.document = api::with_format(scene.document, format);
  formats.push_back(format);
}

tracer::Result<Reply, Problem> rendered_image(const queue::Job& job, tracer::Format format, const ApiContext& context) {
  const std::string name = tracer::file_name(format);
  const queue::Artifact* const artifact = find_artifact(job, name);
  if (artifact == nullptr) throw std::runtime_error("job " + job.id + " has no " + name);
  auto reply = image_reply(job, *artifact, context);
  if (reply) reply->headers.emplace_back("Content-Location", "/v1/jobs/" + job.id + "/" + name);
  return reply;
}

/// The redirection of a download. A small image costs less than a second request. Scripts and images of a page are
/// answered here, because a browser lets them read from this service only.
std::optional<Reply> redirect_to_bucket(const Request& request, const queue::Job& job, const queue::Artifact& artifact,
                                        const ApiContext& context) {
  constexpr std::uint64_t bytes_min = 1u << 20;
  if (!context.redirect || artifact.bytes < bytes_min || request.head.method != "GET") return std::nullopt;
  if (request.head.header("if-none-match") || request.head.header("sec-fetch-mode").value_or("navigate") != "navigate")
    return std::nullopt;
  const std::optional<std::string> url = context.redirect(artifact);
  if (!url) return std::nullopt;
  return Reply{.status = 307, .headers = {{"Location", *url}, {"Cache-Control", "no-store"}}, .job_id = job.id};
}

/// A request whose image is being rendered.
struct PendingRender {
  std::string job_id;
  tracer::Format format = tracer::Format::png;
  Time deadline;
  std::string request_id;
  bool replayed = false;  ///< the job was submitted by an earlier request with the same Idempotency-Key
  bool keep = true;       ///< see queue::Job
};

Answer reply_or_wait(const PendingRender& pending, const ApiContext& context, bool timed_out);

Answer wait_for_image(const PendingRender& pending, const ApiContext& context) {
  DeferredReply deferred = defer_until_ended(pending.job_id, pending.deadline, context, [pending, &context](bool late) {
    return reply_or_wait(pending, context, late);
  });
  if (!pending.keep && !pending.replayed)
    deferred.on_disconnected = [id = pending.job_id, &context] { context.queue.lifecycle.cancel(id); };
  return deferred;
}

Answer reply_or_wait(const PendingRender& pending, const ApiContext& context, bool timed_out) {
  auto view = find_job(pending.job_id, context);
  if (view && timed_out && !queue::ended(view->job.state)) {
    context.queue.submission.make_durable(pending.job_id);  // the reply 202 accepts the job
    view = find_job(pending.job_id, context);
  }
  if (!view) return view.error();
  const queue::Job& job = view->job;
  const bool ended = queue::ended(job.state);
  if (!ended && !timed_out) return wait_for_image(pending, context);
  Reply reply;
  if (job.expired || (ended && job.state != queue::JobState::succeeded)) {
    reply = problem_reply(job.expired ? images_expired(job) : problem_of(job), pending.request_id);
  } else if (ended) {
    auto image = rendered_image(job, pending.format, context);
    if (!image) return image.error();
    reply = *std::move(image);
  } else {
    reply = job_reply(202, *view, context);
  }
  if (pending.replayed) reply.headers.emplace_back("Idempotent-Replayed", "true");
  return reply;
}

constexpr std::uint32_t preview_side_default = 512;

/// Longest wait for a new preview; a later one serves the next request.
constexpr std::chrono::seconds preview_wait{2};

/// The parameter max; nothing if it is invalid.
std::optional<std::uint32_t> read_side(const Pairs& query) {
  if (query.empty()) return preview_side_default;
  const auto side = parse_number<std::uint32_t>(query.front().second);
  const bool valid = side && *side >= queue::image_side_min && *side <= queue::preview_side_max;
  return valid ? side : std::nullopt;
}

const queue::Artifact* png_of(const queue::Job& job) {
  const auto png = std::ranges::find(job.artifacts, "image/png", &queue::Artifact::media_type);
  return png == job.artifacts.end() ? nullptr : &*png;
}

/// Redirects to the PNG image of a job that has ended.
Answer redirect_to_image(const queue::Job& job) {
  if (job.expired) return images_expired(job);
  const queue::Artifact* const png = png_of(job);
  if (png == nullptr) {
    const std::string reason = job.artifacts.empty() ? "; it has no images" : ", and not as PNG";
    return Problem{failures::image_not_found, "job " + job.id + " is " + queue::name_of(job.state) + reason};
  }
  const std::string location = "/v1/jobs/" + job.id + "/" + png->name;
  return Reply{.status = 303, .headers = {{"Location", location}, {"Cache-Control", "no-cache"}}, .job_id = job.id};
}

/// A PNG with its hash as ETag.
Reply preview_reply(const std::string& job_id, const std::string& png) {
  return {.content_type = "image/png",
          .headers = {{"ETag", '"' + tracer::sha256_hex(png) + '"'}, {"Cache-Control", "no-cache"}},
          .body = png,
          .job_id = job_id};
}

/// The job, also while the database is away if an image of it was read before.
tracer::Result<queue::Job, Problem> find_job_of_image(const std::string& id, const ApiContext& context) {
  try {
    auto view = find_job(id, context);
    if (!view) return view.error();
    if (view->job.state == queue::JobState::succeeded) {
      queue::Job kept = view->job;
      kept.report.clear();
      context.recent_jobs->add(id, std::move(kept), 1);
    }
    return std::move(view->job);
  } catch (const queue::StoreFailure&) {
    if (auto job = context.recent_jobs->find(id)) return *std::move(job);
    throw;
  }
}

/// The latest preview, without waiting.
Answer latest_preview(const std::string& id, std::uint32_t side, const ApiContext& context) {
  const auto view = find_job(id, context);
  if (!view) return view.error();
  if (queue::ended(view->job.state)) return redirect_to_image(view->job);
  const queue::Previews::Latest latest = context.queue.waiters.preview(id, side);
  if (latest.png) return preview_reply(id, *latest.png);
  return Reply{.status = 204, .headers = {{"Cache-Control", "no-store"}}, .job_id = id};
}

/// The name is the end of the route.
Answer get_image(Request& request, const ApiContext& context) {
  const std::string name = request.route.substr(request.route.rfind('/') + 1);
  const auto found = find_job_of_image(request.parameters.front(), context);
  if (!found) return found.error();
  const queue::Job& job = *found;
  const queue::Artifact* const artifact = find_artifact(job, name);
  if (artifact == nullptr) return image_not_found(job, name);

  if (auto redirect = redirect_to_bucket(request, job, *artifact, context)) return *std::move(redirect);
  auto image = image_reply(job, *artifact, context);
  if (!image) return image.error();
  Reply& reply = *image;
  reply.headers.emplace_back("Cache-Control", "max-age=31536000, immutable");  // an image never changes
  reply.headers.emplace_back("Accept-Ranges", "bytes");
  apply_range(request, reply, '"' + artifact->sha256 + '"');
  return std::move(reply);
}

Answer render(Request& request, const ApiContext& context) {
  if (auto problem = refuse_if_draining(context)) return *problem;
  auto scene = take_scene(request, context);
  if (!scene) return scene.error();
  const auto format = accepted_format(request, scene->parsed.scene);
  if (!format) {
    return Problem{failures::not_acceptable, "accept image/png, image/x-exr or another supported image format"};
  }
  add_format(*scene, *format);  // so that requests with different formats are different under an Idempotency-Key
  queue::Submission submission = submission_of(request, std::move(*scene), context);
  const bool keep = submission.job.keep;
  submission.durable = false;  // a client that loses the connection repeats the request
  submission.with_position = false;
  const auto submitted = submit(request, std::move(submission), context);
  if (!submitted) return submitted.error();
  const auto deadline = std::chrono::steady_clock::now() + context.render_wait;
  if (submitted->replayed) {
    const std::string id = submitted->replayed->location.substr(std::string_view("/v1/jobs/").size());
    return reply_or_wait({id, *format, deadline, request.id, true}, context, false);
  }
  if (!submitted->from_cache)
    return wait_for_image({submitted->view.job.id, *format, deadline, request.id, false, keep}, context);
  auto reply = rendered_image(submitted->view.job, *format, context);
  if (!reply) return reply.error();
  reply->headers.emplace_back("X-Cache", "hit");
  return *std::move(reply);
}

Answer get_preview(Request& request, const ApiContext& context) {
  const auto side = read_side(request.head.query);
  if (!side) {
    const std::string range = std::to_string(queue::image_side_min) + ".." + std::to_string(queue::preview_side_max);
    return Problem{failures::invalid_query, "max must be given once, as a whole number " + range};
  }
  const auto view = find_job(request.parameters.front(), context);
  if (!view) return view.error();
  const std::string& id = view->job.id;
  queue::JobWaiters& waiters = context.queue.waiters;
  const bool is_scaled = queue::ended(view->job.state) && !request.head.query.empty() &&
                         std::max(view->job.width, view->job.height) > *side;
  queue::ImageWork work;
  work.side = *side;
  if (const queue::Artifact* const png = is_scaled ? png_of(view->job) : nullptr)
    return processed_image(view->job, *png, work, context);
  const bool traced = view->job.state == queue::JobState::running && view->job.kind == queue::JobKind::render;
  if (!traced || waiters.preview(id, *side).fresh) return latest_preview(id, *side, context);

  const auto watch = [&waiters, id, side](std::function<void()> notify) -> std::function<void()> {
    return [&waiters, token = waiters.request_preview(id, *side, std::move(notify))] { waiters.cancel(token); };
  };
  const auto resume = [&context, id, side](bool) { return latest_preview(id, *side, context); };
  return DeferredReply{std::chrono::steady_clock::now() + preview_wait, watch, resume};
}

}  // namespace

std::string key_of(const std::string& images, const queue::ImageWork& work) {
  std::string key = images + ' ' + work.kind + ' ' + std::to_string(work.side) + ' ' + std::to_string(work.layer) +
                    (work.heat ? " heat " : " ");
  std::vector<double> numbers{work.exposure};
  for (const auto& more : {work.range, work.tolerance}) numbers.insert(numbers.end(), more.begin(), more.end());
  for (const double number : numbers) key.append(reinterpret_cast<const char*>(&number), sizeof number);
  for (const std::uint32_t edge : work.crop) key += ' ' + std::to_string(edge);
  return key;
}

ImageResult find_processed(const queue::Artifact& artifact, const queue::ImageWork& work, const ApiContext& context) {
  return context.image_tasks->find(key_of(artifact.sha256, work));
}

Answer process_image(const queue::Artifact& artifact, const queue::ImageWork& work, const ApiContext& context,
                     std::function<Answer(const ImageResult&)> use) {
  std::shared_ptr<queue::ArtifactReader> reader = context.queue.queries.open(artifact);
  if (!reader)
    return Problem{failures::image_damaged, artifact.name + ", " + artifact.sha256 + ", is missing or damaged"};
  return context.image_tasks->run(key_of(artifact.sha256, work), {work, {std::move(reader)}}, std::move(use));
}

Answer processed_image(const queue::Job& job, const queue::Artifact& artifact, const queue::ImageWork& work,
                       const ApiContext& context) {
  const auto reply = [id = job.id](const ImageResult& result) -> Answer { return preview_reply(id, result->bytes); };
  if (const ImageResult kept = find_processed(artifact, work, context)) return reply(kept);
  return process_image(artifact, work, context, reply);
}

Problem image_not_found(const queue::Job& job, const std::string& name) {
  if (job.expired) return images_expired(job);
  if (job.state == queue::JobState::succeeded) {
    return {failures::image_not_found, "job " + job.id + " has no output " + name};
  }
  const std::string reason = queue::ended(job.state) ? "; it has no images" : "; its images exist once it succeeded";
  return {failures::image_not_found, "job " + job.id + " is " + queue::name_of(job.state) + reason};
}

Endpoints image_endpoints() {
  Endpoints all{{"POST", "/v1/render", render}, {"GET", "/v1/jobs/{id}/preview", get_preview, {.query = {"max"}}}};
  std::vector<std::string> names{"preview.png", "measure.json", "measure.csv",
                                 "measure.svg", "measure.png",  "reference.exr"};
  for (const tracer::Format format : tracer::all_formats) names.push_back(tracer::file_name(format));
  for (const std::string& name : names) all.push_back({"GET", "/v1/jobs/{id}/" + name, get_image});
  return all;
}

}  // namespace http::handlers
