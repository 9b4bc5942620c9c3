#pragma once
/// Opens the files of scenes for a worker process, which cannot open any itself.

#include <thread>

#include "server/worker/protocol/asset_directory.h"
#include "server/worker/protocol/protocol.h"

namespace worker {

/// Answers each FileRequest of the worker with a FileResponse, one at a time on a thread of its own, so that neither a
/// slow disk nor a worker that floods it delays anything else. What the worker may open is what scenes may name
/// (SceneFiles), opened for reading. Never throws after construction.
class FileServer {
 public:
  /// `socket` blocks. `open_upload`: see SceneFiles. Throws std::system_error without a thread.
  FileServer(Descriptor socket, FileSettings settings, OpenUpload open_upload = {});
  ~FileServer();  ///< closes the connection and waits for the thread
  FileServer(FileServer&&) = delete;

 private:
  void serve();

  const Descriptor socket_;
  const FileSettings settings_;
  const OpenUpload open_upload_;
  std::thread thread_;  ///< last: starts after the other members
};

}  // namespace worker
