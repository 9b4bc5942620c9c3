#include "server/worker/process/file_client.h"

#include <unistd.h>

#include <algorithm>
#include <cstdint>
#include <stdexcept>
#include <utility>
#include <vector>

#include "server/support/file_io.h"

namespace worker {
namespace {

/// Up to asset_bytes_max bytes; fewer if the file is truncated meanwhile. Without fstat, which libc turns into a call
/// that the sandbox refuses.
api::AssetBytes content_of(const Descriptor& file) {
  const off_t size = lseek(file.get(), 0, SEEK_END);
  std::vector<std::uint8_t> bytes(
      std::clamp<std::size_t>(static_cast<std::size_t>(std::max<off_t>(size, 0)), 0, api::asset_bytes_max));
  const ssize_t count = support::read_at(file.get(), 0, reinterpret_cast<char*>(bytes.data()), bytes.size());
  if (count < 0) return std::string("cannot be read");
  bytes.resize(static_cast<std::size_t>(count));
  return bytes;
}

}  // namespace

FileResponse FileClient::request(FileRequest request) {
  const std::lock_guard lock(mutex_);
  if (send(socket_.get(), pack(std::move(request))) == Sent::yes) {
    Received received = receive(socket_.get(), daemon_body_limit, FileRule::any);
    auto* const message = std::get_if<Message>(&received);
    auto* const response = message == nullptr ? nullptr : std::get_if<FileResponse>(message);
    if (response != nullptr && response->failure.empty()) return std::move(*response);
    if (response != nullptr && response->unavailable) throw FilesUnavailable(response->failure);
    if (response != nullptr) throw std::runtime_error(response->failure);
  }
  throw std::runtime_error("the daemon opens no files");
}

api::AssetBytes FileClient::read(const std::string& name) {
  const FileResponse response = request({name});
  if (response.file.empty()) return response.refusal;
  return content_of(response.file.front());
}

std::string FileClient::content_name(const std::string& name) { return request({name, true}).content_name; }

}  // namespace worker
