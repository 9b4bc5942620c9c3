#include "server/storage/files/file_stores.h"

#include <fcntl.h>
#include <sys/stat.h>

#include <array>
#include <cerrno>
#include <optional>
#include <utility>

#include "tracer/sha256.h"

namespace storage::files {

// ---- FileArtifactStore

FileArtifactStore::FileArtifactStore(std::string directory, queue::DiskHealth* health)
    : directory_(std::move(directory)), health_(health == nullptr ? own_health_ : *health) {
  create_directories(directory_);
}

queue::ArtifactStore::Stored FileArtifactStore::put(int fd, bool durable) {
  return health_.run([&] { return store(fd, durable); });
}

queue::ArtifactStore::Stored FileArtifactStore::store(int fd, bool durable) {
  TemporaryFile temporary(directory_);
  Stored stored = temporary.copy(contents_of(fd, "the source"));
  const std::string target = path_of(directory_, stored.sha256);
  if (!durable && open(stored.sha256)) return stored;
  if (durable) temporary.sync();  // also over a durable file: another thread may remove that at any moment
  temporary.rename_to(target);    // also over a file that power loss has truncated
  if (durable) sync_path(subdirectory(directory_, stored.sha256));
  verified_.add(stored.sha256);
  return stored;
}

void FileArtifactStore::sync(const std::string& sha256) {
  health_.run([&] {
    sync_path(path_of(directory_, sha256));
    sync_path(subdirectory(directory_, sha256));
  });
}

std::unique_ptr<queue::ArtifactReader> FileArtifactStore::open(const std::string& sha256, bool verified) {
  auto reader = open_reader(directory_, sha256);
  if (!reader || !verified || verified_.contains(sha256)) return reader;
  if (hash_of(contents_of(*reader)).sha256 != sha256) return nullptr;
  verified_.add(sha256);
  return reader;
}

std::optional<FileArtifactStore::Scrubbed> FileArtifactStore::scrub() {
  for (;;) {
    while (scrub_names_.empty()) {
      if (scrub_part_ == queue::AssetStore::parts) {
        scrub_part_ = 0;
        return std::nullopt;
      }
      for (NamedFile& file : files_of_part(directory_, scrub_part_++)) scrub_names_.push_back(std::move(file.sha256));
    }
    const std::string name = std::move(scrub_names_.back());
    scrub_names_.pop_back();
    const auto reader = open_reader(directory_, name);
    if (!reader) continue;  // removed meanwhile
    const Stored found = hash_of(contents_of(*reader));
    if (found.sha256 != name) verified_.remove(name);
    return Scrubbed{{name, found.bytes}, found.sha256 != name};
  }
}

void FileArtifactStore::remove(const std::string& sha256) {
  if (!tracer::is_sha256(sha256)) return;
  remove_file(directory_, sha256);
  verified_.remove(sha256);
}

// ---- FileAssetStore

FileAssetStore::FileAssetStore(std::string directory, queue::Clock clock, std::uint64_t bytes_max,
                               queue::DiskHealth* health)
    : directory_(std::move(directory)),
      clock_(std::move(clock)),
      bytes_max_(bytes_max),
      health_(health == nullptr ? own_health_ : *health) {
  create_directories(directory_);
  for (int part = 0; part < parts; ++part)
    for (const NamedFile& file : files_of_part(directory_, part)) bytes_ += file.bytes;
}

queue::AssetStore::Put FileAssetStore::put(const std::string& sha256, const Read& read) {
  return health_.run([&] { return store(sha256, read); });
}

queue::AssetStore::Put FileAssetStore::store(const std::string& sha256, const Read& read) {
  if (!tracer::is_sha256(sha256)) return Put::other_bytes;
  const std::string directory = subdirectory(directory_, sha256);
  if (use(sha256)) {  // read all the same: other bytes under this name are an error
    if (hash_of(read).sha256 != sha256) return Put::other_bytes;
    sync_path(directory);  // another put may be between its rename and its sync
    return Put::was_there;
  }
  TemporaryFile temporary(directory_);
  const queue::ArtifactStore::Stored stored = temporary.copy(read);
  if (stored.sha256 != sha256) return Put::other_bytes;
  temporary.set_time(clock_());
  temporary.sync();
  const Put put = name(temporary, stored);
  if (put == Put::stored) sync_path(directory);
  return put;
}

queue::AssetStore::Put FileAssetStore::name(TemporaryFile& temporary, const queue::ArtifactStore::Stored& stored) {
  const std::lock_guard lock(mutex_);
  const bool is_new = !find_file(directory_, stored.sha256);
  if (is_new && (bytes_ > bytes_max_ || stored.bytes > bytes_max_ - bytes_)) return Put::quota_exceeded;
  temporary.rename_to(path_of(directory_, stored.sha256));
  if (is_new) bytes_ += stored.bytes;
  return Put::stored;
}

bool FileAssetStore::use(const std::string& sha256) {
  if (!tracer::is_sha256(sha256)) return false;
  const std::string path = path_of(directory_, sha256);
  const std::int64_t now = clock_();
  const timespec time{now / 1000, now % 1000 * 1'000'000};
  const std::array<timespec, 2> times{time, time};
  const std::lock_guard lock(mutex_);
  if (utimensat(AT_FDCWD, path.c_str(), times.data(), AT_SYMLINK_NOFOLLOW) == 0) return true;
  if (errno != ENOENT) fail("cannot use", path);
  return false;
}

std::unique_ptr<queue::ArtifactReader> FileAssetStore::open(const std::string& sha256) {
  return open_reader(directory_, sha256);
}

std::vector<std::string> FileAssetStore::unused_since(int part, std::int64_t then) {
  std::vector<std::string> names;
  for (NamedFile& file : files_of_part(directory_, part))
    if (file.modified_ms() < then) names.push_back(std::move(file.sha256));
  return names;
}

bool FileAssetStore::remove_unused_since(const std::string& sha256, std::int64_t then) {
  if (!tracer::is_sha256(sha256)) return false;
  const std::lock_guard lock(mutex_);
  const auto file = find_file(directory_, sha256);
  if (!file || file->modified_ms() >= then) return false;
  remove_file(directory_, sha256);
  bytes_ -= file->bytes;
  return true;
}

}  // namespace storage::files
