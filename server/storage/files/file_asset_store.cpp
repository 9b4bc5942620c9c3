#include "server/storage/files/file_asset_store.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <filesystem>
#include <optional>
#include <utility>

#include "server/storage/files/durable_file.h"
#include "server/storage/files/sha256.h"

namespace jobs {
namespace {

/// Milliseconds since 1970 UTC; nothing where there is no such file.
std::optional<std::int64_t> last_use(const std::string& path) {
  struct stat status {};
  if (lstat(path.c_str(), &status) == 0) return status.st_mtim.tv_sec * 1000 + status.st_mtim.tv_nsec / 1'000'000;
  if (errno != ENOENT) files::fail("cannot stat", path);
  return std::nullopt;
}

std::string name_of_part(int part) {
  constexpr std::string_view digits = "0123456789abcdef";
  const auto byte = static_cast<std::size_t>(part);
  return {digits[byte / 16], digits[byte % 16]};
}

}  // namespace

FileAssetStore::FileAssetStore(std::string folder, Clock clock) : folder_(std::move(folder)), clock_(std::move(clock)) {
  files::prepare_folder(folder_);
}

AssetStore::Put FileAssetStore::put(const std::string& sha256, const Read& read) {
  if (!is_sha256(sha256)) return Put::other_bytes;
  const std::string folder = files::subfolder(folder_, sha256);
  if (use(sha256)) {  // read all the same: whoever sends other bytes under this name has to know
    if (files::hash_of(read, {}).sha256 != sha256) return Put::other_bytes;
    files::sync_folder(folder);  // another put may stand between its rename and this
    return Put::was_there;
  }
  files::Temporary temporary(folder_ + "/tmp/" + std::to_string(temporary_count_++));
  if (temporary.copy(read).sha256 != sha256) return Put::other_bytes;
  temporary.set_time(clock_());
  temporary.sync();
  {
    const std::lock_guard lock(mutex_);
    temporary.rename_to(files::path_of(folder_, sha256));
  }
  files::sync_folder(folder);
  return Put::stored;
}

bool FileAssetStore::use(const std::string& sha256) {
  if (!is_sha256(sha256)) return false;
  const std::string path = files::path_of(folder_, sha256);
  const std::int64_t now = clock_();
  const timespec time{now / 1000, now % 1000 * 1'000'000};
  const std::array<timespec, 2> times{time, time};
  const std::lock_guard lock(mutex_);
  if (utimensat(AT_FDCWD, path.c_str(), times.data(), AT_SYMLINK_NOFOLLOW) == 0) return true;
  if (errno != ENOENT) files::fail("cannot use", path);
  return false;
}

std::unique_ptr<ArtifactReader> FileAssetStore::open(const std::string& sha256) {
  return files::open_reader(folder_, sha256);
}

std::vector<std::string> FileAssetStore::unused_since(int part, std::int64_t then) {
  const std::string folder = folder_ + "/" + name_of_part(part);
  std::vector<std::string> names;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    std::string name = entry.path().filename();
    const auto used = last_use(entry.path());
    if (is_sha256(name) && used && *used < then) names.push_back(std::move(name));
  }
  if (error) throw StoreFailure(StoreFailure::Kind::unavailable, "cannot list " + folder + ": " + error.message());
  return names;
}

bool FileAssetStore::remove_unused_since(const std::string& sha256, std::int64_t then) {
  if (!is_sha256(sha256)) return false;
  const std::string path = files::path_of(folder_, sha256);
  const std::lock_guard lock(mutex_);
  const auto used = last_use(path);
  if (!used || *used >= then) return false;
  if (unlink(path.c_str()) == 0) return true;
  if (errno != ENOENT) files::fail("cannot delete", path);
  return false;
}

}  // namespace jobs
