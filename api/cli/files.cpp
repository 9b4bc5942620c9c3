#include "api/cli/files.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <system_error>
#include <utility>
#include <vector>

#include "api/json.h"

namespace cli {
namespace {

[[noreturn]] void throw_error(const char* action, const std::string& path, int error) {
  throw std::runtime_error(std::string("cannot ") + action + " " + path + ": " + std::strerror(error));
}

std::string directory_of(const std::string& path) {
  const auto slash = path.rfind('/');
  if (slash == std::string::npos) return ".";
  return slash == 0 ? "/" : path.substr(0, slash);
}

/// Permissions that open() gives to a new file; mkstemp does not.
mode_t default_permissions() {
  const mode_t mask = ::umask(0);
  ::umask(mask);
  return 0666U & ~mask;
}

/// Errors of file systems without O_TMPFILE (open(2)).
bool is_tmpfile_unsupported(int error) { return error == EOPNOTSUPP || error == EISDIR || error == ENOENT; }

/// Size of a regular file and one byte more, so that one read reaches its end; otherwise a first buffer.
std::size_t initial_buffer_bytes(int descriptor) {
  constexpr std::size_t block = std::size_t{1} << 20;
  struct stat status {};
  if (::fstat(descriptor, &status) != 0 || !S_ISREG(status.st_mode)) return block;
  return static_cast<std::size_t>(status.st_size) + 1;
}

template <class Bytes>
Bytes read_into(const std::string& path, std::size_t limit) {
  const bool standard_input = path == "-";
  const int descriptor = standard_input ? STDIN_FILENO : ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) throw_error("read", path, errno);
  Bytes bytes(std::min(initial_buffer_bytes(descriptor), limit + 1), {});
  std::size_t done = 0;
  ssize_t got = 0;
  while (done <= limit) {
    if (done == bytes.size()) bytes.resize(std::min(2 * done, limit + 1));
    got = ::read(descriptor, bytes.data() + done, bytes.size() - done);
    if (got <= 0) break;
    done += static_cast<std::size_t>(got);
  }
  const int error = got < 0 ? errno : 0;
  if (!standard_input) ::close(descriptor);
  if (error != 0) throw_error("read", path, error);
  bytes.resize(done);
  return bytes;
}

namespace fs = std::filesystem;

/// Reason not to open the file, else empty. Pipes and devices could block forever.
std::string error_before_open(const fs::path& path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (error && error != std::errc::no_such_file_or_directory) return error.message();
  if (!fs::exists(status)) return "no such file at " + path.string();
  if (!fs::is_regular_file(status)) return "is not a regular file";
  const std::uintmax_t size = fs::file_size(path, error);
  if (error) return error.message();
  if (size <= api::asset_bytes_max) return "";
  return "the limit asset_bytes_max is " + std::to_string(api::asset_bytes_max) + ", it has " + std::to_string(size);
}

api::AssetBytes read(const fs::path& path) {
  if (std::string error = error_before_open(path); !error.empty()) return error;
  try {
    return read_into<std::vector<std::uint8_t>>(path.string(), api::asset_bytes_max);
  } catch (const std::runtime_error& failure) {
    return std::string(failure.what());
  }
}

api::AssetBytes read_upload(const std::string& directory, const std::string& name) {
  if (directory.empty()) return std::string("names an uploaded file: --assets DIRECTORY is required");
  const std::string hash = name.substr(api::upload_prefix.size());
  const fs::path plain = fs::path(directory) / hash;
  return read(fs::exists(plain) ? plain : fs::path(directory) / hash.substr(0, 2) / hash);
}

}  // namespace

std::string read_text(const std::string& path, std::size_t limit) { return read_into<std::string>(path, limit); }

void write_file(const std::string& path, std::span<const std::uint8_t> bytes) {
  PendingFile file(path);
  file.write(bytes);
  file.publish();
}

PendingFile::PendingFile(std::string path) : path_(std::move(path)) {
  struct stat existing {};
  if (::stat(path_.c_str(), &existing) == 0 && S_ISDIR(existing.st_mode)) throw_error("write", path_, EISDIR);
  descriptor_ = ::open(directory_of(path_).c_str(), O_TMPFILE | O_WRONLY | O_CLOEXEC, 0666);
  if (descriptor_ >= 0) return;
  if (!is_tmpfile_unsupported(errno)) throw_error("write", path_, errno);
  std::string temporary = path_ + ".whittle-XXXXXX";
  descriptor_ = ::mkostemp(temporary.data(), O_CLOEXEC);
  if (descriptor_ < 0) throw_error("write", path_, errno);
  temporary_ = std::move(temporary);
  ::fchmod(descriptor_, default_permissions());
}

PendingFile::PendingFile(PendingFile&& other) noexcept
    : path_(std::move(other.path_)),
      descriptor_(std::exchange(other.descriptor_, -1)),
      temporary_(std::exchange(other.temporary_, {})) {}

PendingFile::~PendingFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
  if (!temporary_.empty()) ::unlink(temporary_.c_str());
}

void PendingFile::write(std::span<const std::uint8_t> bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(descriptor_, bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) throw_error("write", path_, errno);
    bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
  if (::fsync(descriptor_) != 0) throw_error("write", path_, errno);
}

void PendingFile::publish() {
  if (temporary_.empty()) {
    const std::string unlinked = "/proc/self/fd/" + std::to_string(descriptor_);
    const auto link_as = [&](const std::string& name) {
      return ::linkat(AT_FDCWD, unlinked.c_str(), AT_FDCWD, name.c_str(), AT_SYMLINK_FOLLOW) == 0;
    };
    if (link_as(path_)) return;
    if (errno != EEXIST) throw_error("write", path_, errno);
    temporary_ = path_ + ".whittle-" + std::to_string(::getpid());  // linkat replaces nothing, rename does
    if (!link_as(temporary_)) throw_error("write", std::exchange(temporary_, {}), errno);
  }
  if (::rename(temporary_.c_str(), path_.c_str()) != 0) throw_error("write", path_, errno);
  temporary_.clear();
}

std::string read_document(const SceneSource& source, const std::string& directory) {
  const fs::path path(source.path);
  std::string extension = path.extension().string();
  std::ranges::transform(extension, extension.begin(), [](unsigned char c) { return std::tolower(c); });
  constexpr std::string_view models[] = {".glb", ".gltf", ".obj", ".ply", ".stl"};
  if (std::ranges::find(models, extension) == std::end(models))
    return read_text(source.path, api::DocumentLimits{}.bytes);
  api::Json document{{"version", 1}, {"model", directory.empty() ? path.filename() : fs::proximate(path, directory)}};
  if (source.time) document["time"] = *source.time;
  return api::json_line(document);
}

api::Limits reading_limits() {
  api::Limits limits;
  limits.files = api::Files::anywhere;
  limits.uploads = true;
  return limits;
}

api::ReadAsset asset_reader(const SceneSource& source) {
  const fs::path directory = source.path == "-" ? fs::path() : fs::path(source.path).parent_path();
  return [directory, uploads = source.assets_directory](const std::string& name) {
    return name.starts_with(api::upload_prefix) ? read_upload(uploads, name) : read(directory / name);
  };
}

tracer::Result<std::monostate, api::Refusal> load_scene(api::DocumentRender& render, const std::string& text,
                                                        const SceneSource& source) {
  const api::Limits limits = reading_limits();
  if (auto parsed = render.parse(text, limits); !parsed) return parsed;
  api::Refusal refusal;
  auto loaded = render.import(asset_reader(source), limits);
  if (loaded) loaded = render.load(asset_reader(source), limits.scene);
  if (loaded) return std::monostate{};
  refusal.issues = std::move(loaded.error());
  return refusal;
}

}  // namespace cli
