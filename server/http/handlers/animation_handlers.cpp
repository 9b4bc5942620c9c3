/// The images of a batch as an animation.

#include <utility>

#include "server/http/handlers/handlers.h"
#include "server/http/header_text.h"

namespace http::handlers {
namespace {

constexpr std::size_t reduced_bytes_max = 64u << 20;  // reduced frames are in memory until they are sent

struct AnimationQuery {
  int frames_per_second = 24;
  std::uint32_t side = 0;  ///< 0: frames keep their size
};

tracer::Result<AnimationQuery, Problem> read_query(const Pairs& query) {
  AnimationQuery wanted;
  for (const auto& [name, value] : query) {
    if (name == "fps") wanted.frames_per_second = parse_number<int>(value).value_or(0);
    if (name != "max") continue;
    wanted.side = parse_number<std::uint32_t>(value).value_or(0);
    if (wanted.side < queue::image_side_min || wanted.side > queue::preview_side_max)
      return Problem{failures::invalid_query, "max must be a whole number " + std::to_string(queue::image_side_min) +
                                                  ".." + std::to_string(queue::preview_side_max)};
  }
  if (wanted.frames_per_second >= 1 && wanted.frames_per_second <= 60) return wanted;
  return Problem{failures::invalid_query, "fps must be a whole number 1..60"};
}

Answer animation_reply(std::size_t images, OpenFrame open, int frames_per_second) {
  auto source = apng_of(images, std::move(open), frames_per_second);
  if (!source) return Problem{failures::images_differ, "an animation needs images of one size and kind"};
  return Reply{.content_type = "image/apng", .headers = {{"Cache-Control", "no-cache"}}, .source = std::move(source)};
}

struct Reduction {
  std::vector<queue::Artifact> images;
  AnimationQuery query;
  std::vector<ImageResult> frames;
  std::size_t bytes = 0;
};

/// Reduces one frame after the other, without a thread while the worker is busy.
Answer reduce_frames(const std::shared_ptr<Reduction>& reduction, const ApiContext& context) {
  queue::ImageWork work;
  work.side = reduction->query.side;
  const auto add = [reduction](const ImageResult& frame) {
    reduction->frames.push_back(frame);
    reduction->bytes += frame->bytes.size();
  };
  while (reduction->frames.size() < reduction->images.size()) {
    if (reduction->bytes > reduced_bytes_max)
      return Problem{failures::invalid_query, "max is too large for " + std::to_string(reduction->images.size()) +
                                                  " frames: together they have more than " +
                                                  std::to_string(reduced_bytes_max) + " bytes"};
    const queue::Artifact& image = reduction->images[reduction->frames.size()];
    const ImageResult kept = find_processed(image, work, context);
    if (kept == nullptr)
      return process_image(image, work, context, [add, reduction, &context](const ImageResult& frame) {
        add(frame);
        return reduce_frames(reduction, context);
      });
    add(kept);
  }
  const auto open = [reduction](std::size_t i) {
    const ImageResult& frame = reduction->frames[i];
    return std::make_unique<queue::MemoryReader>(std::shared_ptr<const std::string>(frame, &frame->bytes));
  };
  return animation_reply(reduction->frames.size(), open, reduction->query.frames_per_second);
}

Answer get_animation(Request& request, const ApiContext& context) {
  const auto query = read_query(request.head.query);
  if (!query) return query.error();
  const auto state = find_batch(request.parameters.front(), context);
  if (!state) return state.error();
  std::vector<queue::Artifact> images;
  for (const TarEntry& entry : images_of(state->batch.id, context))
    if (entry.artifact.name == "image.png") images.push_back(entry.artifact);
  if (images.empty())
    return Problem{failures::image_not_found, "no job of batch " + state->batch.id + " has a PNG yet"};
  if (query->side != 0)
    return reduce_frames(std::make_shared<Reduction>(Reduction{std::move(images), *query, {}, 0}), context);
  const std::size_t count = images.size();
  const auto open = [images = std::move(images), &queries = context.queue.queries](std::size_t i) {
    return queries.open(images[i], /*verified=*/false);
  };
  return animation_reply(count, open, query->frames_per_second);
}

}  // namespace

Endpoints animation_endpoints() {
  return {{"GET", "/v1/batches/{id}/animation.apng", get_animation, {.query = {"fps", "max"}, .one_at_a_time = true}}};
}

}  // namespace http::handlers
