#include "server/storage/files/durable_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <utility>
#include <vector>

#include "server/queue/asset_store.h"
#include "tracer/sha256.h"

namespace storage::files {
namespace {

/// Repeats a system call that a signal interrupted.
template <class Call>
auto retry(Call call) {
  for (;;) {
    const auto result = call();
    if (result >= 0 || errno != EINTR) return result;
  }
}

void write_all(int fd, const char* bytes, std::size_t size, const std::string& path) {
  while (size > 0) {
    const ssize_t written = retry([&] { return ::write(fd, bytes, size); });
    if (written < 0) fail("cannot write", path);
    bytes += written;
    size -= static_cast<std::size_t>(written);
  }
}

class FileReader final : public queue::ArtifactReader {
 public:
  FileReader(std::string path, std::unique_ptr<File> file) : path_(std::move(path)), file_(std::move(file)) {
    struct stat status {};
    if (fstat(file_->fd(), &status) < 0) fail("cannot stat", path_);
    size_bytes_ = static_cast<std::uint64_t>(status.st_size);
  }
  std::uint64_t size_bytes() const override { return size_bytes_; }
  std::size_t read(std::uint64_t offset, char* into, std::size_t size) const override {
    return offset >= size_bytes_ ? 0 : read_at(file_->fd(), offset, into, size, path_);
  }

 private:
  std::string path_;
  std::unique_ptr<File> file_;
  std::uint64_t size_bytes_ = 0;
};

void create_directory(const std::string& path) {
  if (mkdir(path.c_str(), 0750) < 0 && errno != EEXIST) fail("cannot create", path);
}

void delete_leftovers(const std::string& directory) {
  for_each_entry(directory, [](const std::filesystem::directory_entry& entry) {
    if (unlink(entry.path().c_str()) < 0) fail("cannot delete", entry.path());
  });
}

}  // namespace

void fail(const std::string& what, const std::string& path) {
  const int error = errno;
  throw queue::StoreFailure(queue::StoreFailure::kind_of(error), what + " " + path + ": " + std::strerror(error));
}

File::File(const std::string& path, int flags)
    : fd_(retry([&] { return ::open(path.c_str(), flags | O_CLOEXEC, 0640); })) {}
File::~File() {
  if (fd_ >= 0) ::close(fd_);
}

std::size_t read_at(int fd, std::uint64_t offset, char* into, std::size_t size, const std::string& name) {
  std::size_t done = 0;
  while (done < size) {
    const ssize_t got = retry([&] { return pread(fd, into + done, size - done, static_cast<off_t>(offset + done)); });
    if (got < 0) fail("cannot read", name);
    if (got == 0) break;
    done += static_cast<std::size_t>(got);
  }
  return done;
}

queue::ArtifactStore::Stored hash_of(const ReadAt& read, const Take& take) {
  tracer::Sha256 hash;
  std::uint64_t bytes = 0;
  std::vector<char> chunk(1u << 18);
  for (;;) {
    const std::size_t got = read(bytes, chunk.data(), chunk.size());
    if (got == 0) return {hash.hex(), bytes};
    hash.add(chunk.data(), got);
    if (take) take(chunk.data(), got);
    bytes += got;
  }
}

queue::ArtifactStore::Stored hash_of(const queue::ArtifactReader& reader) {
  return hash_of([&](std::uint64_t offset, char* into, std::size_t size) { return reader.read(offset, into, size); });
}

TemporaryFile::TemporaryFile(std::string path) : path_(std::move(path)), file_(path_, O_WRONLY | O_CREAT | O_EXCL) {
  if (file_.fd() < 0) fail("cannot create", path_);
}

TemporaryFile::~TemporaryFile() {
  if (!renamed_) unlink(path_.c_str());
}

queue::ArtifactStore::Stored TemporaryFile::copy(const ReadAt& read) {
  return hash_of(read, [this](const char* bytes, std::size_t size) { write_all(file_.fd(), bytes, size, path_); });
}

void TemporaryFile::set_time(std::int64_t unix_ms) {
  const timespec time{unix_ms / 1000, unix_ms % 1000 * 1'000'000};
  const std::array<timespec, 2> times{time, time};
  if (futimens(file_.fd(), times.data()) < 0) fail("cannot set the time of", path_);
}

void TemporaryFile::sync() {
  if (retry([&] { return fsync(file_.fd()); }) < 0) fail("cannot sync", path_);
}

void TemporaryFile::rename_to(const std::string& target) {
  if (rename(path_.c_str(), target.c_str()) < 0) fail("cannot rename to", target);
  renamed_ = true;
}

void sync_path(const std::string& path) {
  const File file(path, O_RDONLY | O_NOFOLLOW);
  if (file.fd() < 0) fail("cannot open", path);
  if (retry([&] { return fsync(file.fd()); }) < 0) fail("cannot sync", path);
}

void sync_disk(const std::string& path) {
  const File directory(path, O_RDONLY | O_DIRECTORY);
  if (directory.fd() < 0 || syncfs(directory.fd()) < 0) fail("cannot sync", path);
}

void create_directories(const std::string& directory, Leftovers leftovers) {
  create_directory(directory);
  create_directory(directory + "/tmp");
  // All of them, so that a later put syncs only its own directory.
  for (int part = 0; part < queue::AssetStore::parts; ++part) create_directory(directory + "/" + name_of_part(part));
  sync_path(directory);
  sync_path(directory + "/..");
  if (leftovers == Leftovers::remove) delete_leftovers(directory + "/tmp");
}

std::string name_of_part(int part) {
  constexpr std::string_view digits = "0123456789abcdef";
  const auto byte = static_cast<std::size_t>(part);
  return {digits[byte / 16], digits[byte % 16]};
}

std::string subdirectory(const std::string& directory, const std::string& sha256) {
  return directory + "/" + sha256.substr(0, 2);
}

std::string path_of(const std::string& directory, const std::string& sha256) {
  return subdirectory(directory, sha256) + "/" + sha256;
}

void for_each_entry(const std::string& directory,
                    const std::function<void(const std::filesystem::directory_entry&)>& each) {
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(directory, error)) each(entry);
  if (error) throw queue::StoreFailure("cannot list " + directory + ": " + error.message());
}

std::optional<NamedFile> find_file(const std::string& directory, const std::string& sha256) {
  const std::string path = path_of(directory, sha256);
  struct stat status {};
  if (lstat(path.c_str(), &status) == 0) {
    return NamedFile{
        sha256, static_cast<std::uint64_t>(status.st_size), {status.st_mtim.tv_sec, status.st_mtim.tv_nsec}};
  }
  if (errno != ENOENT && errno != ESTALE) fail("cannot stat", path);
  return std::nullopt;
}

std::vector<NamedFile> files_of_part(const std::string& directory, int part) {
  std::vector<NamedFile> files;
  for_each_entry(directory + "/" + name_of_part(part), [&](const std::filesystem::directory_entry& entry) {
    const std::string name = entry.path().filename();
    if (!tracer::is_sha256(name)) return;
    if (auto file = find_file(directory, name)) files.push_back(*std::move(file));
  });
  std::sort(files.begin(), files.end(), [](const auto& a, const auto& b) { return a.sha256 < b.sha256; });
  return files;
}

void remove_file(const std::string& directory, const std::string& sha256) {
  const std::string path = path_of(directory, sha256);
  if (unlink(path.c_str()) < 0 && errno != ENOENT) fail("cannot delete", path);
}

std::unique_ptr<queue::ArtifactReader> open_reader(const std::string& directory, const std::string& sha256) {
  if (!tracer::is_sha256(sha256)) return nullptr;
  const std::string path = path_of(directory, sha256);
  auto file = std::make_unique<File>(path, O_RDONLY | O_NOFOLLOW);
  if (file->fd() < 0) {
    if (errno == ENOENT) return nullptr;
    fail("cannot open", path);
  }
  return std::make_unique<FileReader>(path, std::move(file));
}

}  // namespace storage::files
