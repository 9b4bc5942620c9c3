#include "server/storage/files/copy_files.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>

#include "server/queue/artifact_store.h"
#include "server/storage/files/durable_file.h"
#include "tracer/sha256.h"

namespace storage::files {
namespace {

void copy_file(const std::string& from, const std::string& sha256, const std::string& into) {
  const File source(from, O_RDONLY | O_NOFOLLOW);
  if (source.fd() < 0 && errno == ENOENT) return;
  struct stat status {};
  if (source.fd() < 0 || fstat(source.fd(), &status) < 0) fail("cannot open", from);
  TemporaryFile copy(into + "/tmp/" + sha256);
  const auto stored = copy.copy([&](std::uint64_t offset, char* bytes, std::size_t size) {
    return read_at(source.fd(), offset, bytes, size, from);
  });
  if (stored.sha256 != sha256) {
    throw queue::StoreFailure(queue::StoreFailure::Kind::unavailable,
                              from + " is damaged: its bytes have the sha256 " + stored.sha256);
  }
  copy.set_time(std::int64_t{status.st_mtim.tv_sec} * 1000 + status.st_mtim.tv_nsec / 1'000'000);
  copy.rename_to(path_of(into, sha256));
}

}  // namespace

void copy_files(const std::string& directory, const std::string& into) {
  create_directories(into);
  for (const auto& part : std::filesystem::directory_iterator(into)) {
    const std::string source = directory + "/" + part.path().filename().string();
    if (part.path().filename().string().size() != 2 || !std::filesystem::is_directory(source)) continue;
    for (const auto& file : std::filesystem::directory_iterator(source)) {
      const std::string sha256 = file.path().filename();
      if (tracer::is_sha256(sha256)) copy_file(file.path(), sha256, into);
    }
  }
}

void sync_disk(const std::string& path) {
  const File directory(path, O_RDONLY | O_DIRECTORY);
  if (directory.fd() < 0 || syncfs(directory.fd()) < 0) fail("cannot sync", path);
}

}  // namespace storage::files
