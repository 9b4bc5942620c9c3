#include "server/worker/supervisor/file_server.h"

#include <sys/socket.h>

#include <exception>
#include <utility>

#include "server/worker/protocol/asset_directory.h"

namespace worker {
namespace {

FileResponse respond(const FileRequest& request, const FileSettings& settings) {
  FileResponse response;
  try {
    const SceneFiles files(settings);
    if (request.content_name_only) {
      response.content_name = files.content_name(request.name);
    } else if (auto file = files.open(request.name)) {
      response.file.push_back(std::move(*file));
    } else {
      response.refusal = file.error();
    }
  } catch (const std::exception& failure) {  // no descriptors or memory, or no directory
    response.failure = failure.what();
  }
  return response;
}

}  // namespace

FileServer::FileServer(Descriptor socket, FileSettings settings)
    : socket_(std::move(socket)), settings_(std::move(settings)), thread_([this] { serve(); }) {}

FileServer::~FileServer() {
  shutdown(socket_.get(), SHUT_RDWR);
  thread_.join();
}

void FileServer::serve() {
  constexpr std::size_t request_bytes_max = 64u << 10;
  try {
    for (;;) {
      Received received = receive(socket_.get(), request_bytes_max);
      auto* const message = std::get_if<Message>(&received);
      const auto* const request = message == nullptr ? nullptr : std::get_if<FileRequest>(message);
      if (request == nullptr) break;  // it has ended, or is faulty
      if (send(socket_.get(), pack(respond(*request, settings_))) != Sent::yes) break;
    }
  } catch (const std::exception&) {
    // Without memory for a response the worker loses its files, and its jobs fail until it is replaced.
  }
  shutdown(socket_.get(), SHUT_RDWR);
}

}  // namespace worker
