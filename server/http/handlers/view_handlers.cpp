/// Layers of finished images as PNG, and the live form of a scene, by the worker.

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "server/http/handlers/handlers.h"
#include "server/http/header_text.h"
#include "tracer/encode.h"
#include "tracer/sha256.h"
#include "tracer/version.h"
#include "tracer/view.h"

namespace http::handlers {
namespace {

constexpr std::uint32_t view_side_default = 1024;
constexpr double exposure_max = 100;  // stops, as in documents

/// Numbers that are separated by commas; none if there are not `count`, or one is not finite.
template <class Number>
std::vector<Number> read_numbers(std::string_view text, std::size_t count) {
  std::vector<Number> numbers;
  for (bool more = true; more && numbers.size() < count;) {
    const std::size_t comma = text.find(',');
    more = comma != std::string_view::npos;
    const auto number = parse_number<Number>(text.substr(0, comma));
    if (!number || !std::isfinite(static_cast<double>(*number))) return {};
    numbers.push_back(*number);
    if (more) text.remove_prefix(comma + 1);
    if (!more && numbers.size() == count) return numbers;
  }
  return {};
}

/// The parameters of a request. Problem: 400.
class Parameters {
 public:
  Parameters(const Pairs& query, const queue::Job& job) : query_(query), job_(job) {}

  tracer::Result<queue::ImageWork, Problem> read() {
    work_.kind = "view";
    work_.side = view_side_default;
    const std::pair<const char*, std::string (Parameters::*)(const std::string&)> steps[] = {
        {"layer", &Parameters::read_layer}, {"exposure", &Parameters::read_exposure},
        {"range", &Parameters::read_range}, {"map", &Parameters::read_map},
        {"crop", &Parameters::read_crop},   {"max", &Parameters::read_side}};
    for (const auto& [name, step] : steps)
      for (const auto& [given, text] : query_)
        if (const std::string error = given == name ? (this->*step)(text) : ""; !error.empty())
          return Problem{failures::invalid_query, error};
    return work_;
  }

 private:
  [[nodiscard]] tracer::ViewedLayer layer() const { return static_cast<tracer::ViewedLayer>(work_.layer); }

  std::string read_layer(const std::string& text) {
    const auto& names = tracer::viewed_layer_names;
    const auto found = std::ranges::find(names, text);
    work_.layer = static_cast<std::uint8_t>(found - std::begin(names));
    return found != std::end(names) ? "" : "layer must be color, depth, normal, albedo, object_id, samples or error";
  }

  std::string read_exposure(const std::string& text) {
    if (!tracer::is_light(layer())) return "exposure is for the layers color and albedo";
    const auto stops = read_numbers<double>(text, 1);
    if (stops.empty() || std::abs(stops[0]) > exposure_max) return "exposure must be a number of stops, -100..100";
    work_.exposure = stops[0];
    return {};
  }

  std::string read_range(const std::string& text) {
    if (!tracer::is_number(layer()) && layer() != tracer::ViewedLayer::normal)
      return "range is for the layers depth, normal, samples and error";
    work_.range = read_numbers<double>(text, 2);
    return !work_.range.empty() && work_.range[0] < work_.range[1] ? "" : "range must be two increasing numbers, LO,HI";
  }

  std::string read_map(const std::string& text) {
    if (!tracer::is_number(layer())) return "map is for the layers depth, samples and error";
    work_.heat = text == "heat";
    return work_.heat || text == "gray" ? "" : "map must be gray or heat";
  }

  std::string read_crop(const std::string& text) {
    work_.crop = read_numbers<std::uint32_t>(text, 4);
    const auto fits = [&](std::size_t axis, std::uint32_t size) {
      const std::uint64_t begin = work_.crop[axis], length = work_.crop[axis + 2];
      return length > 0 && begin + length <= size;
    };
    if (!work_.crop.empty() && fits(0, job_.width) && fits(1, job_.height)) return {};
    return "crop must be X,Y,WIDTH,HEIGHT within the " + std::to_string(job_.width) + " x " +
           std::to_string(job_.height) + " pixels";
  }

  std::string read_side(const std::string& text) {
    work_.side = parse_number<std::uint32_t>(text).value_or(0);
    if (work_.side >= queue::image_side_min && work_.side <= queue::image_side_max) return {};
    return "max must be a whole number " + std::to_string(queue::image_side_min) + ".." +
           std::to_string(queue::image_side_max);
  }

  const Pairs& query_;
  const queue::Job& job_;
  queue::ImageWork work_;
};

/// OpenEXR, which has all layers and is not clamped, or for the color any other image; null if there is none.
const queue::Artifact* source_of_layer(const queue::Job& job, tracer::ViewedLayer layer) {
  const queue::Artifact* artifact = find_artifact(job, "image.exr");
  if (layer != tracer::ViewedLayer::color) return artifact;
  for (const tracer::Format format : tracer::all_formats)
    if (artifact == nullptr) artifact = find_artifact(job, tracer::file_name(format));
  return artifact;
}

Answer get_view(Request& request, const queue::JobView& view, const ApiContext& context) {
  const auto work = Parameters(request.head.query, view.job).read();
  if (!work) return work.error();
  const auto layer = static_cast<tracer::ViewedLayer>(work->layer);
  const queue::Artifact* const source = source_of_layer(view.job, layer);
  if (source == nullptr)
    return image_not_found(view.job, layer == tracer::ViewedLayer::color ? "image.png" : "image.exr");
  return processed_image(view.job, *source, *work, context);
}

/// A document determines its live form, unless it names files, which may change.
std::string live_key(const Scene& scene, const ApiContext& context) {
  const std::string when = scene.content.named_files ? std::to_string(context.clock()) : std::string(tracer::build());
  return tracer::sha256_hex(scene.document) + " live " + when;
}

Answer make_live_form(Request& request, const ApiContext& context) {
  auto scene = take_scene(request, context);
  if (!scene) return scene.error();
  const std::string key = live_key(*scene, context);
  queue::ImageTask task;
  task.work.kind = "live";
  task.work.document = std::move(scene->document);
  return context.image_tasks->run(key, task, [](const ImageResult& result) -> Answer {
    const auto read = [result](std::uint64_t offset, char* into, std::size_t size) {
      return result->bytes.copy(into, size, offset);
    };
    return Reply{.content_type = "application/octet-stream", .source = BodySource{result->bytes.size(), read}};
  });
}

}  // namespace

Endpoints view_endpoints() {
  return {{"POST", "/v1/live", make_live_form},
          {"GET", "/v1/jobs/{id}/view.png", get_view, {.query = {"layer", "exposure", "range", "map", "crop", "max"}}}};
}

}  // namespace http::handlers
