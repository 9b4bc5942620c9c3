#include "server/worker/process/image_tasks.h"

#include <oneapi/tbb/task_arena.h>
#include <unistd.h>

#include <chrono>
#include <exception>
#include <mutex>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "tracer/compare.h"

namespace worker {
namespace {

std::vector<std::uint8_t> read_memory(const Descriptor& memory) {
  std::vector<std::uint8_t> bytes(static_cast<std::size_t>(lseek(memory.get(), 0, SEEK_END)));
  if (pread(memory.get(), bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size()))
    throw std::runtime_error("an image cannot be read");
  return bytes;
}

std::string result_of(const ImageTask& task) {
  const auto png = tracer::thumbnail(read_memory(task.images.at(0)), task.side);
  if (!png) throw std::runtime_error(png.error());
  return {png->begin(), png->end()};
}

}  // namespace

void run_image_task(ImageTask task, int socket) noexcept {
  static std::mutex one_at_a_time;  // an image takes many times its file in memory
  const std::lock_guard lock(one_at_a_time);
  ImageTaskResult result{task.number, {}, {}};
  try {
    oneapi::tbb::task_arena arena;
    result.bytes = arena.execute([&] { return result_of(task); });
  } catch (const std::exception& failure) {
    result.failure = failure.what();
  }
  const Packet packet = pack(std::move(result));
  while (send(socket, packet) == Sent::later) std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

}  // namespace worker
