/// Comparison of two images, by the worker.

#include <algorithm>
#include <array>
#include <utility>

#include "api/json.h"
#include "api/reader/fields.h"
#include "server/http/handlers/handlers.h"
#include "tracer/encode.h"
#include "tracer/sha256.h"

namespace http::handlers {
namespace {

constexpr std::uint64_t compared_bytes_max = 1'000'000'000;  // 64 Mpx of uncompressed floats

/// Two images, each as the sha256 of an upload, the id of a job, or "ID/image.exr".
struct CompareRequest {
  std::string a, b;
  std::optional<double> tolerance;  ///< levels, >= 0
  bool heat = false;
};

void read_compare(api::Reading& reading, CompareRequest& request) {
  api::Fields fields(reading, reading.root, "a comparison");
  fields.required("a", request.a);
  fields.required("b", request.b);
  if (const auto tolerance = fields.take("tolerance")) {
    double levels = 0;
    if (read(reading, *tolerance, levels) && levels < 0)
      add_issue(reading, *tolerance, "out_of_range", "must be >= 0, a root mean square error in levels");
    request.tolerance = levels;
  }
  fields.optional("heat", request.heat);
  fields.finish();
}

/// An image as a client names it.
struct NamedImage {
  std::optional<queue::Job> job;  ///< none: an upload
  std::string name;               ///< the artifact, empty: any image of the job; or the sha256 of the upload
};

struct OpenedImage {
  std::string sha256;
  std::shared_ptr<queue::ArtifactReader> reader;
};

tracer::Result<NamedImage, Problem> find_image(const std::string& text, const ApiContext& context) {
  if (tracer::is_sha256(text)) {
    if (context.assets.use(text)) return NamedImage{{}, text};
    return Problem{failures::asset_not_found, "there is no asset " + text + "; upload it with PUT"};
  }
  const std::size_t slash = text.find('/');
  auto view = find_job(text.substr(0, slash), context);
  if (!view) return view.error();
  NamedImage image{std::move(view->job), slash == std::string::npos ? "" : text.substr(slash + 1)};
  if (image.job->expired) return images_expired(*image.job);
  return image;
}

/// Chooses images of jobs that are named without one: in the first format that both have, or else in their own first.
void choose_formats(std::array<NamedImage, 2>& images) {
  const auto is_open = [](const NamedImage& image) { return image.job && image.name.empty(); };
  for (const bool common : {true, false}) {
    for (const tracer::Format format : tracer::all_formats) {
      const std::string name = tracer::file_name(format);
      const auto has = [&](const NamedImage& image) { return image.job && find_artifact(*image.job, name) != nullptr; };
      const bool both = std::ranges::all_of(images, [&](const auto& i) { return !is_open(i) || has(i); });
      for (NamedImage& image : images)
        if (is_open(image) && has(image) && (both || !common)) image.name = name;
    }
  }
}

tracer::Result<OpenedImage, Problem> open_image(const NamedImage& image, const ApiContext& context) {
  OpenedImage opened{image.name, nullptr};
  if (image.job) {
    const std::string name = image.name.empty() ? "image.png" : image.name;
    const queue::Artifact* const artifact = find_artifact(*image.job, name);
    if (artifact == nullptr) return image_not_found(*image.job, name);
    opened = {artifact->sha256, context.queue.queries.open(*artifact)};
    if (!opened.reader)
      return Problem{failures::image_damaged, name + " of job " + image.job->id + " is missing or damaged"};
  } else {
    opened.reader = context.assets.open(image.name);
    if (!opened.reader) return Problem{failures::asset_not_found, "there is no asset " + image.name + " any more"};
  }
  if (opened.reader->size_bytes() <= compared_bytes_max) return opened;
  return Problem{failures::bad_image, "the limit of an image is " + std::to_string(compared_bytes_max) +
                                          " bytes, it has " + std::to_string(opened.reader->size_bytes())};
}

/// Keeps the heat map as an upload and names it in the reply.
Answer comparison_reply(const queue::ImageTaskResult& result, const ApiContext& context) {
  api::Json comparison = api::Json::parse(result.text, nullptr, false);
  if (!comparison.is_object()) return Problem{failures::image_not_processed, "the worker sent no comparison"};
  api::Json& url = comparison["heat_map"];
  if (!result.bytes.empty()) {
    const std::string sha256 = tracer::sha256_hex(result.bytes);
    const auto put = context.assets.put(sha256, [&](std::uint64_t offset, char* into, std::size_t size) {
      return result.bytes.copy(into, size, offset);
    });
    if (put == queue::AssetStore::Put::quota_exceeded)
      return Problem{failures::uploads_full, "the heat map would exceed the limit uploads_bytes of " +
                                                 std::to_string(context.uploads_bytes) + "; compare without it"};
    url = "/v1/assets/" + sha256;
  }
  return json_reply(200, api::json_line(comparison));
}

Answer compare_images(Request& request, const ApiContext& context) {
  const auto wanted = take_request(request, "a comparison", read_compare, context.limits);
  if (!wanted) return wanted.error();
  if (const queue::DiskSpace space = context.queue.queries.disk_space();
      wanted->heat && space.state != queue::DiskSpace::State::enough)
    return disk_full(space);
  std::array<NamedImage, 2> images;
  for (std::size_t i = 0; i < 2; ++i) {
    auto found = find_image(i == 0 ? wanted->a : wanted->b, context);
    if (!found) return found.error();
    images.at(i) = *std::move(found);
  }
  choose_formats(images);
  queue::ImageTask task;
  task.work.kind = "compare";
  task.work.side = queue::image_side_max;
  task.work.heat = wanted->heat;
  if (wanted->tolerance) task.work.tolerance.push_back(*wanted->tolerance);
  std::string names;
  for (const NamedImage& image : images) {
    auto opened = open_image(image, context);
    if (!opened) return opened.error();
    names += opened->sha256 + ' ';
    task.images.push_back(std::move(opened->reader));
  }
  return context.image_tasks->run(key_of(names, task.work), task,
                                  [&context](const ImageResult& result) { return comparison_reply(*result, context); });
}

}  // namespace

Endpoints compare_endpoints() { return {{"POST", "/v1/compare", compare_images}}; }

}  // namespace http::handlers
