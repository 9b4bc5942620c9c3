/// Packets of a worker that is in the hands of an attacker: the daemon must neither crash on them nor accept what it
/// cannot store, list and serve. The input is a sequence of packets: a byte with the kind of message (255: the body is
/// the whole packet), a byte with the number of files (bit 5: the first is large, bit 6: not sealed), two bytes with
/// the size of the body, and the body.

#include <sys/mman.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/resources/resource_json.h"
#include "server/worker/supervisor/message_check.h"
#include "tests/fuzz/require.h"

namespace {

const queue::Job request = [] {
  queue::Job render;
  render.width = render.height = 16;
  render.formats = "png 16.png exr jpg hdr webp tiff";
  return render;
}();

std::vector<worker::Descriptor> make_files(unsigned flags) {
  constexpr unsigned count_bits = 31, large = 32, unsealed = 64;
  std::vector<worker::Descriptor> files;
  for (unsigned i = 0; i < (flags & count_bits) && i < 16; ++i) {
    if (i > 0 || (flags & (large | unsealed)) == 0) {
      files.push_back(worker::sealed_memory("file"));
    } else if ((flags & unsealed) != 0) {
      files.emplace_back(memfd_create("open", MFD_CLOEXEC));
    } else {
      files.push_back(worker::sealed_memory(std::string(1 << 20, 'x')));
    }
  }
  return files;
}

std::string packet_of(unsigned kind, std::string_view body) {
  if (kind == 255) return std::string(body);
  const std::uint32_t version = worker::protocol_version, kind_of_message = kind;
  const std::uint64_t size = body.size();
  std::string packet(16, '\0');
  std::memcpy(packet.data(), &version, 4);
  std::memcpy(packet.data() + 4, &kind_of_message, 4);
  std::memcpy(packet.data() + 8, &size, 8);
  return packet.append(body);
}

/// Lists a job with an accepted result or failure.
void use(queue::Job job) {
  queue::JobView view;
  view.job = std::move(job);
  const std::string text = resources::write_job(view, 0);
  require(!text.empty() && text.find('\n') == text.size() - 1, "a job is one line");
}

void check(const worker::Message& message) {
  if (!worker::violation_of(message).empty()) return;
  queue::Job job;
  if (const auto* failed = std::get_if<worker::Failed>(&message)) {
    job.problem = failed->problem;
    return use(std::move(job));
  }
  const auto* finished = std::get_if<worker::Finished>(&message);
  if (finished == nullptr || !worker::check_result(*finished, request)) return;
  job.report = finished->report;
  for (const worker::Image& image : finished->images) {
    require(image.name.find_first_of("/\r\n\"\\") == std::string::npos && image.name[0] != '.', "names are plain");
    require(image.media_type.starts_with("image/"), "files of a render are images");
    const off_t size = lseek(image.bytes.get(), 0, SEEK_END);
    require(size >= 0 && static_cast<std::uint64_t>(size) <= worker::image_bytes_max(16, 16),
            "files are not too large");
    job.artifacts.push_back({image.name, image.media_type, std::string(64, '0'), static_cast<std::uint64_t>(size)});
  }
  use(std::move(job));
}

}  // namespace

// NOLINTNEXTLINE(readability-identifier-naming): libFuzzer's name for it
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::array<int, 2> ends{};
  require(socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC | SOCK_NONBLOCK, 0, ends.data()) == 0, "there are sockets");
  const worker::Descriptor daemon_end(ends[0]), worker_end(ends[1]);
  while (size >= 4) {
    const unsigned kind = data[0], files = data[1];
    const std::size_t body_size = std::min<std::size_t>(data[2] + 256u * data[3], size - 4);
    const std::string_view body(reinterpret_cast<const char*>(data) + 4, body_size);
    data += 4 + body_size;
    size -= 4 + body_size;
    if (worker::send(worker_end.get(), {packet_of(kind, body), make_files(files)}) != worker::Sent::yes) continue;
    const worker::Received received = worker::receive(daemon_end.get(), worker::worker_body_limit);
    if (const auto* message = std::get_if<worker::Message>(&received)) check(*message);
  }
  return 0;
}
