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
#include "server/queue/clock.h"
#include "server/support/file_io.h"
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

/// Empty, with errno, if the file cannot be opened.
support::Descriptor open_file(const std::string& path, int flags) {
  return support::Descriptor(retry([&] { return ::open(path.c_str(), flags | O_CLOEXEC, 0640); }));
}

/// A name that no file of any process has.
std::string new_name() {
  static queue::IdSource ids(queue::system_clock(), queue::system_random());
  return ids.next();
}

std::size_t read_at(int fd, std::uint64_t offset, char* into, std::size_t size, const std::string& name) {
  const ssize_t count = support::read_at(fd, offset, into, size);
  if (count < 0) fail("cannot read", name);
  return static_cast<std::size_t>(count);
}

class FileReader final : public queue::ArtifactReader {
 public:
  FileReader(std::string path, support::Descriptor file) : path_(std::move(path)), file_(std::move(file)) {
    struct stat status {};
    if (fstat(file_.get(), &status) < 0) fail("cannot stat", path_);
    size_bytes_ = static_cast<std::uint64_t>(status.st_size);
  }
  std::uint64_t size_bytes() const override { return size_bytes_; }
  std::size_t read(std::uint64_t offset, char* into, std::size_t size) const override {
    return offset >= size_bytes_ ? 0 : read_at(file_.get(), offset, into, size, path_);
  }

 private:
  std::string path_;
  support::Descriptor file_;
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

ReadAt contents_of(int fd, const std::string& name) {
  return
      [fd, name](std::uint64_t offset, char* into, std::size_t size) { return read_at(fd, offset, into, size, name); };
}

ReadAt contents_of(const queue::ArtifactReader& reader) {
  return [&](std::uint64_t offset, char* into, std::size_t size) { return reader.read(offset, into, size); };
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

TemporaryFile::TemporaryFile(const std::string& directory)
    : path_(directory + "/tmp/" + new_name()), file_(open_file(path_, O_WRONLY | O_CREAT | O_EXCL)) {
  if (!file_) fail("cannot create", path_);
}

TemporaryFile::~TemporaryFile() {
  if (!renamed_) unlink(path_.c_str());
}

queue::ArtifactStore::Stored TemporaryFile::copy(const ReadAt& read) {
  return hash_of(read, [this](const char* bytes, std::size_t size) {
    if (!support::write_all(file_.get(), {bytes, size})) fail("cannot write", path_);
  });
}

void TemporaryFile::set_time(std::int64_t unix_ms) {
  const timespec time{unix_ms / 1000, unix_ms % 1000 * 1'000'000};
  const std::array<timespec, 2> times{time, time};
  if (futimens(file_.get(), times.data()) < 0) fail("cannot set the time of", path_);
}

void TemporaryFile::sync() {
  if (retry([&] { return fsync(file_.get()); }) < 0) fail("cannot sync", path_);
}

void TemporaryFile::rename_to(const std::string& target) {
  if (rename(path_.c_str(), target.c_str()) < 0) fail("cannot rename to", target);
  renamed_ = true;
}

void sync_path(const std::string& path) {
  const support::Descriptor file = open_file(path, O_RDONLY | O_NOFOLLOW);
  if (!file) fail("cannot open", path);
  if (retry([&] { return fsync(file.get()); }) < 0) fail("cannot sync", path);
}

void sync_disk(const std::string& path) {
  const support::Descriptor directory = open_file(path, O_RDONLY | O_DIRECTORY);
  if (!directory || syncfs(directory.get()) < 0) fail("cannot sync", path);
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

std::string name_of_part(int part) { return tracer::hex_of(std::string(1, static_cast<char>(part))); }

std::string subdirectory(const std::string& directory, const std::string& sha256) {
  return directory + "/" + sha256.substr(0, 2);
}

std::string path_of(const std::string& directory, const std::string& sha256) {
  return directory + "/" + queue::asset_path(sha256);
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
  std::ranges::sort(files, {}, &NamedFile::sha256);
  return files;
}

void remove_file(const std::string& directory, const std::string& sha256) {
  const std::string path = path_of(directory, sha256);
  if (unlink(path.c_str()) < 0 && errno != ENOENT) fail("cannot delete", path);
}

std::unique_ptr<queue::ArtifactReader> open_reader(const std::string& directory, const std::string& sha256) {
  if (!tracer::is_sha256(sha256)) return nullptr;
  const std::string path = path_of(directory, sha256);
  support::Descriptor file = open_file(path, O_RDONLY | O_NOFOLLOW);
  if (!file && errno == ENOENT) return nullptr;
  if (!file) fail("cannot open", path);
  return std::make_unique<FileReader>(path, std::move(file));
}

}  // namespace storage::files
