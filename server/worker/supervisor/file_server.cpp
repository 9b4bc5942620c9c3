#include "server/worker/supervisor/file_server.h"

#include <sys/socket.h>

#include <exception>
#include <utility>

#include "server/queue/job_store.h"

namespace worker {
namespace {

FileResponse respond(const FileRequest& request, const FileSettings& settings, const OpenUpload& open_upload) {
  FileResponse response;
  try {
    const SceneFiles files(settings, open_upload);
    if (request.content_name_only) {
      response.content_name = files.content_name(request.name);
    } else if (auto file = files.open(request.name)) {
      response.file.push_back(std::move(*file));
    } else {
      response.refusal = file.error();
    }
  } catch (const queue::StoreFailure& failure) {
    response.failure = failure.what();
    response.unavailable = failure.kind == queue::StoreFailure::Kind::unavailable;
  } catch (const std::exception& failure) {  // no descriptors or memory, or no directory
    response.failure = failure.what();
  }
  return response;
}

}  // namespace

FileServer::FileServer(Descriptor socket, FileSettings settings, OpenUpload open_upload)
    : socket_(std::move(socket)),
      settings_(std::move(settings)),
      open_upload_(std::move(open_upload)),
      thread_([this] { serve(); }) {}

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
      if (send(socket_.get(), pack(respond(*request, settings_, open_upload_))) != Sent::yes) break;
    }
  } catch (const std::exception&) {
    // Without memory for a response the worker loses its files, and its jobs fail until it is replaced.
  }
  shutdown(socket_.get(), SHUT_RDWR);
}

}  // namespace worker
