#pragma once
/// Reading a scene and writing images: every failure of the environment becomes one sentence here.

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "tracer/result.h"

namespace cli {

/// "cannot write /images/a.png: No space left on device"
struct FileFailure {
  std::string sentence;
};
using Done = tracer::Result<std::monostate, FileFailure>;

/// All of `path` ("-": standard input), but at most `limit` + 1 bytes: enough for the reader to see that it is too
/// large.
tracer::Result<std::string, FileFailure> read_all(const std::string& path, std::size_t limit);
tracer::Result<std::vector<std::uint8_t>, FileFailure> read_all_bytes(const std::string& path, std::size_t limit);

/// A file that is being written under no name, in the directory where it will appear. Destroyed before `publish`, or
/// killed with its process, it leaves nothing behind. Two exceptions, which only SIGKILL or power loss shows: the
/// moment between linking and renaming when an old file is replaced, and file systems that cannot hold nameless files.
/// There it has a passing name, its path + ".whittle-" + a few characters.
class PendingFile {
 public:
  PendingFile(PendingFile&& other) noexcept;
  PendingFile(const PendingFile&) = delete;
  PendingFile& operator=(PendingFile&&) = delete;
  PendingFile& operator=(const PendingFile&) = delete;
  ~PendingFile();

  /// Fails when `path` cannot be written: told before the work, not after it.
  static tracer::Result<PendingFile, FileFailure> create(const std::string& path);

  /// To the disk, so that a full one is told here. After a failure nothing new is visible.
  Done write(std::span<const std::uint8_t> bytes);
  /// Gives the file its name, at once and complete, in place of any file that had it.
  Done publish();

 private:
  PendingFile(std::string path, int descriptor, std::string temporary);

  std::string path_;
  int descriptor_ = -1;
  std::string temporary_;  ///< its passing name; empty while it has none
};

}  // namespace cli
