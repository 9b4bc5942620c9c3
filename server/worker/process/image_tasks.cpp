#include <oneapi/tbb/task_arena.h>
#include <unistd.h>

#include <array>
#include <exception>
#include <mutex>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "api/measurement_json.h"
#include "server/support/file_io.h"
#include "server/worker/process/jobs.h"
#include "tracer/compare.h"
#include "tracer/encode.h"
#include "tracer/view.h"

namespace worker {
namespace {

std::vector<std::uint8_t> read_memory(const Descriptor& memory) {
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(lseek(memory.get(), 0, SEEK_END)));
  if (support::read_at(memory.get(), 0, reinterpret_cast<char*>(bytes.data()), bytes.size()) !=
      static_cast<ssize_t>(bytes.size()))
    throw std::runtime_error("an image cannot be read");
  return bytes;
}

using queue::ImageTaskResult;

ImageTaskResult refusal(std::string_view code, std::string sentence) {
  return {std::move(sentence), {}, {}, std::string(code)};
}

ImageTaskResult png_result(const std::vector<std::uint8_t>& png) { return {{}, {png.begin(), png.end()}}; }

ImageTaskResult scale(const ImageTask& task) {
  const auto png = tracer::thumbnail(read_memory(task.images.at(0)), task.work.side);
  return png ? png_result(*png) : refusal(queue::bad_image, png.error());
}

ImageTaskResult compare(const ImageTask& task, const tracer::TextureImageLimits& limits) {
  std::array<tracer::ImageFile, 2> files;
  for (std::size_t i = 0; i < files.size(); ++i) {
    auto file = tracer::read_image(read_memory(task.images.at(i)), limits);
    if (!file) return refusal(queue::bad_image, (i == 0 ? "image a " : "image b ") + file.error());
    files[i] = *std::move(file);
  }
  const auto& [a, b] = files;
  const auto found = tracer::compare(a.image, b.image);
  if (!found) return refusal(queue::images_differ, found.error());
  api::ComparisonInfo info{{tracer::row(a.kind).name, tracer::row(b.kind).name}, {}, {}};
  if (!task.work.tolerance.empty()) info.tolerance = task.work.tolerance.front();
  ImageTaskResult result;
  if (task.work.heat) {
    info.heat_white = tracer::heat_scale(*found);
    const tracer::Image heat = tracer::heat_map(a.image, b.image, *info.heat_white, task.work.side);
    const auto png = tracer::encode(heat, tracer::Format::png);
    if (!png) throw std::runtime_error(png.error());
    result = png_result(png->bytes);
  }
  result.text = api::write_comparison(*found, info);
  return result;
}

ImageTaskResult view(const ImageTask& task, const tracer::TextureImageLimits& limits) {
  const queue::ImageWork& work = task.work;
  tracer::View settings{.layer = static_cast<tracer::ViewedLayer>(work.layer), .exposure = work.exposure};
  if (work.range.size() == 2) settings.range = {work.range[0], work.range[1]};
  if (work.crop.size() == 4) settings.crop = {work.crop[0], work.crop[1], work.crop[2], work.crop[3]};
  settings.heat = work.heat;
  settings.side = work.side;
  const auto png = tracer::view(read_memory(task.images.at(0)), settings, limits);
  if (png) return png_result(*png);
  const std::string sentence = "the image " + png.error().sentence;
  const bool lacks_layer = png.error().reason == tracer::ViewFailure::Reason::no_layer;
  return refusal(lacks_layer ? queue::image_not_found : queue::bad_image, sentence);
}

/// Two images and their heat map: floats of three channels each take 36 bytes per pixel, and a decoder some more.
constexpr std::uint64_t bytes_per_pixel = 64;

ImageTaskResult result_of(const ImageTask& task, std::uint64_t memory_bytes) {
  if (task.work.kind == "scale") return scale(task);
  tracer::TextureImageLimits limits = tracer::compared_file_limits;
  limits.pixels = memory_bytes / bytes_per_pixel;
  limits.bytes = limits.channels * sizeof(float) * limits.pixels;
  return task.work.kind == "view" ? view(task, limits) : compare(task, limits);
}

}  // namespace

void run_image_task(ImageTask task, std::uint64_t memory_bytes, int socket) noexcept {
  static std::mutex one_at_a_time;  // an image takes many times its file in memory
  const std::lock_guard lock(one_at_a_time);
  worker::ImageTaskResult message{task.number, {}};
  try {
    oneapi::tbb::task_arena arena;
    message.result = arena.execute([&] { return result_of(task, memory_bytes); });
  } catch (const std::exception& failure) {
    message.result.failure = failure.what();
  }
  send_when_possible(socket, std::move(message));
}

}  // namespace worker
