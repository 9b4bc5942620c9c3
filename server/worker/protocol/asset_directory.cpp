#include "server/worker/protocol/asset_directory.h"

#include <fcntl.h>
#include <linux/openat2.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <ctime>
#include <system_error>
#include <utility>

#include "api/document.h"
#include "server/queue/asset_store.h"

namespace worker {
namespace {

using support::Descriptor;

/// EAGAIN is the result of a concurrent rename while a link with ".." was followed (openat2(2)).
constexpr int tries = 16;

Descriptor open_beneath(const Descriptor& directory, const std::string& name, int flags) {
  open_how how{};
  how.flags = static_cast<std::uint64_t>(flags | O_CLOEXEC);
  how.resolve = RESOLVE_BENEATH | RESOLVE_NO_MAGICLINKS;
  long fd = -1;
  for (int i = 0; i < tries; ++i) {
    fd = syscall(SYS_openat2, directory.get(), name.c_str(), &how, sizeof how);
    if (fd >= 0 || (errno != EAGAIN && errno != EINTR)) break;
  }
  return Descriptor(static_cast<int>(fd));
}

/// The reason for a client, without paths of the server. Throws if the file is not the cause.
std::string reason(int error) {
  if (error == EMFILE || error == ENFILE || error == ENOMEM) {
    throw std::system_error(error, std::generic_category(), "cannot open a file of the scene");
  }
  if (error == ENOENT || error == ENOTDIR) return "no such file";
  if (error == EXDEV) return "leads out of the asset directory";
  return std::generic_category().message(error);
}

/// The size of a regular file within the limit, or the reason why it is none.
tracer::Result<std::size_t, std::string> size_of(const Descriptor& file) {
  struct stat status {};
  if (fstat(file.get(), &status) != 0) return reason(errno);
  if (!S_ISREG(status.st_mode)) return std::string("is no ordinary file");
  const auto size = static_cast<std::size_t>(status.st_size);
  if (size <= api::asset_bytes_max) return size;
  return "the limit asset_bytes_max is " + std::to_string(api::asset_bytes_max) + ", it has " + std::to_string(size);
}

std::int64_t nanoseconds(const timespec& time) { return std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec; }

}  // namespace

AssetDirectory::AssetDirectory(const std::string& path)
    : directory_(::open(path.c_str(), O_PATH | O_DIRECTORY | O_CLOEXEC)) {
  if (directory_ && open_beneath(directory_, ".", O_PATH)) return;
  throw std::system_error(errno, std::generic_category(), "cannot open the asset directory " + path);
}

std::string AssetDirectory::refusal(const std::string& name) const {
  const Descriptor file = open_beneath(directory_, name, O_PATH);
  if (!file) return reason(errno);
  const auto size = size_of(file);
  return size ? std::string() : size.error();
}

std::string AssetDirectory::stamp(const std::string& name) const {
  constexpr std::int64_t resolution_ns = 2'000'000'000;  // of file times on FAT
  const Descriptor file = open_beneath(directory_, name, O_PATH);
  if (!file || !size_of(file)) return {};
  struct stat status {};
  timespec now{};
  if (fstat(file.get(), &status) != 0 || clock_gettime(CLOCK_REALTIME, &now) != 0) return {};
  const std::int64_t changed = std::max(nanoseconds(status.st_mtim), nanoseconds(status.st_ctim));
  if (nanoseconds(now) - changed < resolution_ns) return {};
  std::string stamp = "file";
  for (const auto part :
       {static_cast<std::int64_t>(status.st_dev), static_cast<std::int64_t>(status.st_ino),
        static_cast<std::int64_t>(status.st_size), nanoseconds(status.st_mtim), nanoseconds(status.st_ctim)}) {
    stamp += ":" + std::to_string(part);
  }
  return stamp;
}

OpenedFile AssetDirectory::open(const std::string& name) const {
  // O_NONBLOCK: opening a pipe would wait for its other end; regular files ignore it.
  Descriptor file = open_beneath(directory_, name, O_RDONLY | O_NONBLOCK | O_NOCTTY);
  if (!file) return reason(errno);
  const auto size = size_of(file);
  if (!size) return size.error();
  return file;
}

SceneFiles::SceneFiles(const FileSettings& settings, OpenUpload open_upload) : open_upload_(std::move(open_upload)) {
  if (!settings.directory.empty()) directory_.emplace(settings.directory);
  if (!settings.uploads.empty()) uploads_.emplace(settings.uploads);
}

OpenedFile SceneFiles::open(const std::string& name) const {
  const bool is_upload = name.starts_with(api::upload_prefix);
  if (is_upload && open_upload_ && uploads_) {
    Descriptor file = open_upload_(name.substr(api::upload_prefix.size()));
    if (!file) return std::string("was not uploaded");
    return file;
  }
  const auto& directory = is_upload ? uploads_ : directory_;
  if (!directory) return std::string("there is no directory for it");  // the reader rejects such names
  return directory->open(is_upload ? queue::asset_path(name.substr(api::upload_prefix.size())) : name);
}

std::string SceneFiles::content_name(const std::string& name) const {
  if (name.starts_with(api::upload_prefix)) return uploads_ ? name : std::string();
  return directory_ ? directory_->stamp(name) : std::string();
}

}  // namespace worker
