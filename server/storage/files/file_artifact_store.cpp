#include "server/storage/files/file_artifact_store.h"

#include <unistd.h>

#include <cerrno>
#include <utility>

#include "server/storage/files/durable_file.h"
#include "tracer/sha256.h"

namespace queue {

FileArtifactStore::FileArtifactStore(std::string directory, DiskHealth* health)
    : directory_(std::move(directory)), health_(health == nullptr ? own_health_ : *health) {
  files::create_directories(directory_);
}

ArtifactStore::Stored FileArtifactStore::put(int fd, std::size_t small_bytes) {
  if (small_bytes > 0) {
    std::string bytes(small_bytes + 1, '\0');
    bytes.resize(files::read_at(fd, 0, bytes.data(), bytes.size(), "the source"));
    if (bytes.size() <= small_bytes) return {tracer::sha256_hex(bytes), bytes.size(), std::move(bytes)};
  }
  return health_.run([&] { return store(fd); });
}

ArtifactStore::Stored FileArtifactStore::store(int fd) {
  files::TemporaryFile temporary(directory_ + "/tmp/" + std::to_string(temporary_count_++));
  Stored stored = temporary.copy([fd](std::uint64_t offset, char* into, std::size_t size) {
    return files::read_at(fd, offset, into, size, "the source");
  });
  const std::string target = files::path_of(directory_, stored.sha256);
  // What is there was synced before it got its name. Its directory may not be yet: another put can be at that very
  // point.
  if (access(target.c_str(), F_OK) != 0) {
    temporary.sync();
    temporary.rename_to(target);
  }
  files::sync_directory(files::subdirectory(directory_, stored.sha256));
  return stored;
}

std::unique_ptr<ArtifactReader> FileArtifactStore::open(const std::string& sha256) {
  return files::open_reader(directory_, sha256);
}

void FileArtifactStore::remove(const std::string& sha256) {
  if (!tracer::is_sha256(sha256)) return;
  const std::string path = files::path_of(directory_, sha256);
  if (unlink(path.c_str()) < 0 && errno != ENOENT) files::fail("cannot delete", path);
}

}  // namespace queue
