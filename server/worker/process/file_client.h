#pragma once
/// The files of scenes, which the daemon opens for the worker.

#include <mutex>
#include <stdexcept>
#include <string>

#include "api/load_assets.h"
#include "server/worker/protocol/protocol.h"

namespace worker {

/// The store of uploads is away.
class FilesUnavailable : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Thread-safe; each call waits for the daemon. Calls throw std::runtime_error if the daemon cannot open files now.
class FileClient {
 public:
  /// `socket` is that of Configure.
  explicit FileClient(Descriptor socket) : socket_(std::move(socket)) {}

  /// The content of the file that a document calls `name`, or the reason why it is not available.
  [[nodiscard]] api::AssetBytes read(const std::string& name);

  /// See SceneFiles::content_name.
  [[nodiscard]] std::string content_name(const std::string& name);

 private:
  FileResponse request(FileRequest request);

  std::mutex mutex_;  ///< held from a request to its response
  const Descriptor socket_;
};

}  // namespace worker
