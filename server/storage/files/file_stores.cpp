#include "server/storage/files/file_stores.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <filesystem>
#include <optional>
#include <utility>

#include "server/storage/files/durable_file.h"
#include "tracer/sha256.h"

namespace storage::files {
namespace {

struct Entry {
  std::int64_t used = 0;  ///< milliseconds since 1970 UTC
  std::uint64_t bytes = 0;
};

/// Nothing where there is no such file.
std::optional<Entry> entry_at(const std::string& path) {
  struct stat status {};
  if (lstat(path.c_str(), &status) == 0) {
    return Entry{status.st_mtim.tv_sec * 1000 + status.st_mtim.tv_nsec / 1'000'000,
                 static_cast<std::uint64_t>(status.st_size)};
  }
  if (errno != ENOENT) fail("cannot stat", path);
  return std::nullopt;
}

/// Calls `each(name, entry)` for the assets of one part.
template <class Each>
void walk(const std::string& directory, const Each& each) {
  std::error_code error;
  for (const auto& file : std::filesystem::directory_iterator(directory, error)) {
    const std::string name = file.path().filename();
    const auto entry = entry_at(file.path());
    if (tracer::is_sha256(name) && entry) each(name, *entry);
  }
  if (error)
    throw queue::StoreFailure(queue::StoreFailure::Kind::unavailable,
                              "cannot list " + directory + ": " + error.message());
}

queue::ArtifactStore::Stored hash_of_artifact(const queue::ArtifactReader& reader) {
  return hash_of([&](std::uint64_t offset, char* into, std::size_t size) { return reader.read(offset, into, size); },
                 {});
}

}  // namespace

// ---- FileArtifactStore

FileArtifactStore::FileArtifactStore(std::string directory, queue::DiskHealth* health)
    : directory_(std::move(directory)), health_(health == nullptr ? own_health_ : *health) {
  create_directories(directory_);
}

queue::ArtifactStore::Stored FileArtifactStore::put(int fd, bool durable) {
  return health_.run([&] { return store(fd, durable); });
}

queue::ArtifactStore::Stored FileArtifactStore::store(int fd, bool durable) {
  TemporaryFile temporary(directory_ + "/tmp/" + std::to_string(temporary_count_++));
  Stored stored = temporary.copy([fd](std::uint64_t offset, char* into, std::size_t size) {
    return read_at(fd, offset, into, size, "the source");
  });
  const std::string target = path_of(directory_, stored.sha256);
  if (!durable && open(stored.sha256)) return stored;
  if (durable) temporary.sync();  // also over a durable file: another thread may remove that at any moment
  temporary.rename_to(target);    // also over a file that power loss has truncated
  if (durable) sync_path(subdirectory(directory_, stored.sha256));
  set_verified(stored.sha256, true);
  return stored;
}

void FileArtifactStore::sync(const std::string& sha256) {
  health_.run([&] {
    sync_path(path_of(directory_, sha256));
    sync_path(subdirectory(directory_, sha256));
  });
}

std::unique_ptr<queue::ArtifactReader> FileArtifactStore::open(const std::string& sha256) {
  auto reader = open_reader(directory_, sha256);
  if (!reader || is_verified(sha256)) return reader;
  if (hash_of_artifact(*reader).sha256 != sha256) return nullptr;
  set_verified(sha256, true);
  return reader;
}

std::unique_ptr<queue::ArtifactReader> FileArtifactStore::open_unverified(const std::string& sha256) {
  return open_reader(directory_, sha256);
}

bool FileArtifactStore::is_verified(const std::string& sha256) {
  const std::lock_guard lock(verified_mutex_);
  return verified_.contains(sha256);
}

void FileArtifactStore::set_verified(const std::string& sha256, bool verified) {
  constexpr std::size_t names_max = 100'000;  // 10 MB; then all are compared once more
  const std::lock_guard lock(verified_mutex_);
  if (verified_.size() >= names_max) verified_.clear();
  if (verified) {
    verified_.insert(sha256);
  } else {
    verified_.erase(sha256);
  }
}

std::optional<FileArtifactStore::Scrubbed> FileArtifactStore::scrub() {
  for (;;) {
    while (scrub_names_.empty()) {
      if (scrub_part_ == queue::AssetStore::parts) {
        scrub_part_ = 0;
        return std::nullopt;
      }
      walk(directory_ + "/" + name_of_part(scrub_part_++),
           [&](const std::string& name, const Entry&) { scrub_names_.push_back(name); });
    }
    const std::string name = std::move(scrub_names_.back());
    scrub_names_.pop_back();
    const auto reader = open_reader(directory_, name);
    if (!reader) continue;  // removed meanwhile
    const Stored found = hash_of_artifact(*reader);
    if (found.sha256 != name) set_verified(name, false);
    return Scrubbed{{name, found.bytes}, found.sha256 != name};
  }
}

void FileArtifactStore::remove(const std::string& sha256) {
  if (!tracer::is_sha256(sha256)) return;
  const std::string path = path_of(directory_, sha256);
  if (unlink(path.c_str()) < 0 && errno != ENOENT) fail("cannot delete", path);
  set_verified(sha256, false);
}

// ---- FileAssetStore

FileAssetStore::FileAssetStore(std::string directory, queue::Clock clock, std::uint64_t bytes_max,
                               queue::DiskHealth* health)
    : directory_(std::move(directory)),
      clock_(std::move(clock)),
      bytes_max_(bytes_max),
      health_(health == nullptr ? own_health_ : *health) {
  create_directories(directory_);
  for (int part = 0; part < parts; ++part) {
    walk(directory_ + "/" + name_of_part(part), [&](const std::string&, const Entry& entry) { bytes_ += entry.bytes; });
  }
}

queue::AssetStore::Put FileAssetStore::put(const std::string& sha256, const Read& read) {
  return health_.run([&] { return store(sha256, read); });
}

queue::AssetStore::Put FileAssetStore::store(const std::string& sha256, const Read& read) {
  if (!tracer::is_sha256(sha256)) return Put::other_bytes;
  const std::string directory = subdirectory(directory_, sha256);
  if (use(sha256)) {  // read all the same: other bytes under this name are an error
    if (hash_of(read, {}).sha256 != sha256) return Put::other_bytes;
    sync_path(directory);  // another put may be between its rename and its sync
    return Put::was_there;
  }
  TemporaryFile temporary(directory_ + "/tmp/" + std::to_string(temporary_count_++));
  const queue::ArtifactStore::Stored stored = temporary.copy(read);
  if (stored.sha256 != sha256) return Put::other_bytes;
  temporary.set_time(clock_());
  temporary.sync();
  const Put put = name(temporary, stored);
  if (put == Put::stored) sync_path(directory);
  return put;
}

queue::AssetStore::Put FileAssetStore::name(TemporaryFile& temporary, const queue::ArtifactStore::Stored& stored) {
  const std::string path = path_of(directory_, stored.sha256);
  const std::lock_guard lock(mutex_);
  const bool is_new = !entry_at(path);
  if (is_new && (bytes_ > bytes_max_ || stored.bytes > bytes_max_ - bytes_)) return Put::quota_exceeded;
  temporary.rename_to(path);
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
  const std::string directory = directory_ + "/" + name_of_part(part);
  std::vector<std::string> names;
  walk(directory, [&](const std::string& name, const Entry& entry) {
    if (entry.used < then) names.push_back(name);
  });
  return names;
}

bool FileAssetStore::remove_unused_since(const std::string& sha256, std::int64_t then) {
  if (!tracer::is_sha256(sha256)) return false;
  const std::string path = path_of(directory_, sha256);
  const std::lock_guard lock(mutex_);
  const auto entry = entry_at(path);
  if (!entry || entry->used >= then) return false;
  if (unlink(path.c_str()) == 0) {
    bytes_ -= entry->bytes;
    return true;
  }
  if (errno != ENOENT) fail("cannot delete", path);
  return false;
}

}  // namespace storage::files
