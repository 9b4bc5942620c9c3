#pragma once
/// Files that appear whole and durable under the sha256 of their bytes, or not at all: DIRECTORY/ab/abcdef..., written
/// to DIRECTORY/tmp, synced, then renamed. Private to this directory. Every failure is a StoreFailure that names the
/// path.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "server/queue/artifact_store.h"

namespace queue::files {

/// Throws what errno says about `what` at `path`.
[[noreturn]] void fail(const std::string& what, const std::string& path);

/// An open descriptor; negative, with errno, where the file could not be opened.
class File {
 public:
  File(const std::string& path, int flags);
  ~File();
  File(const File&) = delete;
  File& operator=(const File&) = delete;
  [[nodiscard]] int fd() const { return fd_; }

 private:
  int fd_;
};

/// Positioned reads up to `size` bytes; fewer only at the end. `name` is for the failure.
std::size_t read_at(int fd, std::uint64_t offset, char* into, std::size_t size, const std::string& name);

/// Bytes at an offset, as AssetStore::Read.
using ReadAt = std::function<std::size_t(std::uint64_t offset, char* into, std::size_t size)>;

/// Reads to the end and names what was read; `take`, where given, sees each piece.
using Take = std::function<void(const char* bytes, std::size_t size)>;
ArtifactStore::Stored hash_of(const ReadAt& read, const Take& take);

/// A new file that is deleted again unless it was renamed.
class TemporaryFile {
 public:
  explicit TemporaryFile(std::string path);
  ~TemporaryFile();
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  ArtifactStore::Stored copy(const ReadAt& read);
  void set_time(std::int64_t unix_ms);  ///< of the last change
  void sync();
  void rename_to(const std::string& target);

 private:
  std::string path_;
  File file_;
  bool renamed_ = false;
};

/// DIRECTORY with its 256 directories and tmp, made where missing and synced; what a dead process left in tmp is
/// deleted.
void create_directories(const std::string& directory);
void sync_directory(const std::string& path);

/// DIRECTORY/ab and DIRECTORY/ab/abcdef... Precondition: `sha256` is one.
std::string subdirectory(const std::string& directory, const std::string& sha256);
std::string path_of(const std::string& directory, const std::string& sha256);

/// Null when there is no such file, or `sha256` is none.
std::unique_ptr<ArtifactReader> open_reader(const std::string& directory, const std::string& sha256);

}  // namespace queue::files
