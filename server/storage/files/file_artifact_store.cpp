#include "server/storage/files/file_artifact_store.h"

#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <utility>

#include "server/storage/files/durable_file.h"
#include "tracer/sha256.h"

namespace storage::files {

FileArtifactStore::FileArtifactStore(std::string directory, queue::DiskHealth* health)
    : directory_(std::move(directory)), health_(health == nullptr ? own_health_ : *health) {
  create_directories(directory_);
}

queue::ArtifactStore::Stored FileArtifactStore::put(int fd, bool durable) {
  return health_.run([&] { return store(fd, durable); });
}

queue::ArtifactStore::Stored FileArtifactStore::store(int fd, bool durable) {
  TemporaryFile temporary(directory_ + "/tmp/" + std::to_string(temporary_count_++));
  const Stored stored = temporary.copy([fd](std::uint64_t offset, char* into, std::size_t size) {
    return read_at(fd, offset, into, size, "the source");
  });
  const std::string target = path_of(directory_, stored.sha256);
  std::error_code missing;
  if (!durable && std::filesystem::file_size(target, missing) == stored.bytes && !missing) return stored;
  if (durable) temporary.sync();  // also over a durable file: another thread may remove that at any moment
  temporary.rename_to(target);    // also over a file that power loss has truncated
  if (durable) sync_path(subdirectory(directory_, stored.sha256));
  return stored;
}

void FileArtifactStore::sync(const std::string& sha256) {
  health_.run([&] { sync_existing(sha256); });
}

void FileArtifactStore::sync_existing(const std::string& sha256) {
  sync_path(path_of(directory_, sha256));
  sync_path(subdirectory(directory_, sha256));
}

std::unique_ptr<queue::ArtifactReader> FileArtifactStore::open(const std::string& sha256) {
  return open_reader(directory_, sha256);
}

void FileArtifactStore::remove(const std::string& sha256) {
  if (!tracer::is_sha256(sha256)) return;
  const std::string path = path_of(directory_, sha256);
  if (unlink(path.c_str()) < 0 && errno != ENOENT) fail("cannot delete", path);
}

}  // namespace storage::files
