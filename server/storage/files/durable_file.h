#pragma once
/// Files that appear whole under the sha256 of their bytes, or not at all: DIRECTORY/ab/abcdef..., written to
/// DIRECTORY/tmp, synced where they must be durable, then renamed. Private to server/storage. Every failure is a
/// StoreFailure that names the path.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <unordered_set>
#include <utility>
#include <vector>

#include "server/queue/artifact_store.h"
#include "server/support/descriptor.h"

namespace storage::files {

/// Throws a StoreFailure for errno, with `what` and `path`.
[[noreturn]] void fail(const std::string& what, const std::string& path);

/// Bytes at an offset, as AssetStore::Read: those of a descriptor, with `name` for the failure, or of an artifact. What
/// is read must outlive them.
using ReadAt = std::function<std::size_t(std::uint64_t offset, char* into, std::size_t size)>;
ReadAt contents_of(int fd, const std::string& name);
ReadAt contents_of(const queue::ArtifactReader& reader);

/// Reads to the end and returns sha256 and size; `take`, where given, receives each piece.
using Take = std::function<void(const char* bytes, std::size_t size)>;
queue::ArtifactStore::Stored hash_of(const ReadAt& read, const Take& take = {});

/// A new file in DIRECTORY/tmp that the destructor deletes unless it was renamed.
class TemporaryFile {
 public:
  explicit TemporaryFile(const std::string& directory);
  ~TemporaryFile();
  TemporaryFile(TemporaryFile&&) = delete;

  queue::ArtifactStore::Stored copy(const ReadAt& read);
  void set_time(std::int64_t unix_ms);  ///< the modification time
  void sync();
  void rename_to(const std::string& target);

 private:
  std::string path_;
  support::Descriptor file_;
  bool renamed_ = false;
};

enum class Leftovers { remove, keep };
/// Creates DIRECTORY with its 256 subdirectories and tmp where missing, synced; empties tmp, unless other processes
/// write there too.
void create_directories(const std::string& directory, Leftovers leftovers = Leftovers::remove);
void sync_disk(const std::string& path);  ///< the whole file system of the path
void sync_path(const std::string& path);  ///< an existing file or directory

/// Throws StoreFailure if the directory cannot be listed.
void for_each_entry(const std::string& directory,
                    const std::function<void(const std::filesystem::directory_entry&)>& each);

/// Name of one of the 256 subdirectories: two hex digits.
std::string name_of_part(int part);

/// DIRECTORY/ab and DIRECTORY/ab/abcdef... Precondition: is_sha256.
std::string subdirectory(const std::string& directory, const std::string& sha256);
std::string path_of(const std::string& directory, const std::string& sha256);

/// A file DIRECTORY/ab/abcdef...
struct NamedFile {
  std::string sha256;
  std::uint64_t bytes = 0;
  std::pair<std::int64_t, std::int64_t> modified{};  ///< seconds since 1970 UTC, and nanoseconds
  [[nodiscard]] std::int64_t modified_ms() const { return modified.first * 1000 + modified.second / 1'000'000; }
};
/// Nothing where there is no such file. Precondition: is_sha256.
std::optional<NamedFile> find_file(const std::string& directory, const std::string& sha256);
/// All of one part, in the order of their names.
std::vector<NamedFile> files_of_part(const std::string& directory, int part);
/// No effect where there is none.
void remove_file(const std::string& directory, const std::string& sha256);

/// Null when there is no such file, or not is_sha256.
std::unique_ptr<queue::ArtifactReader> open_reader(const std::string& directory, const std::string& sha256);

/// Names of files that share one property, at most `names_max` of 100 bytes each; then all are removed. Thread-safe.
class NameSet {
 public:
  explicit NameSet(std::size_t names_max) : names_max_(names_max) {}
  void add(const std::string& name) {
    const std::lock_guard lock(mutex_);
    if (names_.size() >= names_max_) names_.clear();
    names_.insert(name);
  }
  void remove(const std::string& name) {
    const std::lock_guard lock(mutex_);
    names_.erase(name);
  }
  [[nodiscard]] bool contains(const std::string& name) const {
    const std::lock_guard lock(mutex_);
    return names_.contains(name);
  }

 private:
  const std::size_t names_max_;
  mutable std::mutex mutex_;
  std::unordered_set<std::string> names_;
};

}  // namespace storage::files
