#include "server/storage/objects/asset_cache.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <utility>
#include <vector>

#include "server/storage/files/durable_file.h"
#include "tracer/sha256.h"

namespace storage::objects {
namespace {

std::vector<files::NamedFile> cached_files(const std::string& directory) {
  std::vector<files::NamedFile> all;
  for (int part = 0; part < queue::AssetStore::parts; ++part)
    for (files::NamedFile& file : files::files_of_part(directory, part)) all.push_back(std::move(file));
  return all;
}

}  // namespace

AssetCache::AssetCache(std::string directory, std::uint64_t bytes_max, queue::AssetStore& assets)
    : directory_(std::move(directory)), bytes_max_(bytes_max), assets_(assets) {
  files::create_directories(directory_);
  for (const files::NamedFile& file : cached_files(directory_)) bytes_ += file.bytes;
}

support::Descriptor AssetCache::open(const std::string& sha256) {
  if (!tracer::is_sha256(sha256)) return {};
  const std::string path = files::path_of(directory_, sha256);
  for (;;) {  // again where the file was deleted between the two calls
    support::Descriptor file(::open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_CLOEXEC));
    if (file) {
      (void)futimens(file.get(), nullptr);  // used now; a failure only changes the order of deletions
      return file;
    }
    if (errno != ENOENT) files::fail("cannot open", path);
    if (!fetch(sha256)) return {};
  }
}

bool AssetCache::fetch(const std::string& sha256) {
  const auto reader = assets_.open(sha256);
  if (!reader) return false;
  files::TemporaryFile temporary(directory_);
  const auto stored = temporary.copy(files::contents_of(*reader));
  if (stored.sha256 != sha256)
    throw queue::StoreFailure(queue::StoreFailure::Kind::damaged, "asset " + sha256 + " has other bytes than its name");
  const std::lock_guard lock(mutex_);
  temporary.rename_to(files::path_of(directory_, sha256));
  bytes_ += stored.bytes;
  if (bytes_ > bytes_max_) make_room();
  return true;
}

/// Deletes the files that were used least recently, until a tenth of the space is free; the newest one stays.
void AssetCache::make_room() {
  std::vector<files::NamedFile> files = cached_files(directory_);
  std::ranges::sort(files, {}, &files::NamedFile::modified);
  bytes_ = 0;
  for (const files::NamedFile& file : files) bytes_ += file.bytes;  // two fetches of one asset have counted it twice
  for (std::size_t i = 0; i + 1 < files.size() && bytes_ > bytes_max_ / 10 * 9; ++i) {
    if (::unlink(files::path_of(directory_, files[i].sha256).c_str()) == 0) bytes_ -= files[i].bytes;
  }
}

}  // namespace storage::objects
