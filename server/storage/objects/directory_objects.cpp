#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <utility>

#include "server/storage/files/durable_file.h"
#include "server/storage/objects/object_store.h"

namespace storage::objects {
namespace {

namespace fs = std::filesystem;

template <class Call>
auto without_io_errors(Call call) {
  try {
    return call();
  } catch (const queue::StoreFailure& failure) {
    if (failure.kind != queue::StoreFailure::Kind::broken) throw;
    throw queue::StoreFailure(failure.what());
  }
}

class FileOfNetwork final : public queue::ArtifactReader {
 public:
  explicit FileOfNetwork(std::unique_ptr<queue::ArtifactReader> file) : file_(std::move(file)) {}
  [[nodiscard]] std::uint64_t size_bytes() const override { return file_->size_bytes(); }
  std::size_t read(std::uint64_t offset, char* into, std::size_t size) const override {
    return without_io_errors([&] { return file_->read(offset, into, size); });
  }

 private:
  const std::unique_ptr<queue::ArtifactReader> file_;
};

class DirectoryObjects final : public ObjectStore {
 public:
  explicit DirectoryObjects(std::string directory) : directory_(std::move(directory)) {
    files::create_directories(directory_, files::Leftovers::keep);
  }

  void put(const std::string& sha256, std::uint64_t /*bytes*/, const queue::AssetStore::Read& read) override {
    without_io_errors([&] { store(sha256, read); });
  }

  std::unique_ptr<queue::ArtifactReader> open(const std::string& sha256) override {
    auto file = without_io_errors([&] { return files::open_reader(directory_, sha256); });
    return file ? std::make_unique<FileOfNetwork>(std::move(file)) : nullptr;
  }

  void remove(const std::string& sha256) override {
    without_io_errors([&] { files::remove_file(directory_, sha256); });
  }

  std::vector<Object> list(const std::string& after) override {
    for (int part = after.empty() ? 0 : std::stoi(after.substr(0, 2), nullptr, 16); part < queue::AssetStore::parts;
         ++part) {
      std::vector<Object> objects;
      for (const auto& file : without_io_errors([&] { return files::files_of_part(directory_, part); }))
        if (file.sha256 > after) objects.push_back({file.sha256, file.bytes});
      if (!objects.empty()) return objects;
    }
    return {};
  }

  void remove_unfinished() override {
    files::for_each_entry(directory_ + "/tmp", [](const fs::directory_entry& file) {
      std::error_code removed;  // by another node, meanwhile
      const auto written = file.last_write_time(removed);
      if (!removed && written < fs::file_time_type::clock::now() - std::chrono::days(1))
        fs::remove(file.path(), removed);
    });
  }

 private:
  void store(const std::string& sha256, const queue::AssetStore::Read& read) {
    const std::string part = files::subdirectory(directory_, sha256);
    // Another node may be reading an intact file, and would lose it over NFS; a put may be between its rename and its
    // sync.
    const auto existing = files::open_reader(directory_, sha256);
    if (existing && files::hash_of(files::contents_of(*existing)).sha256 == sha256) return files::sync_path(part);
    files::TemporaryFile temporary(directory_);
    temporary.copy(read);
    temporary.sync();
    temporary.rename_to(files::path_of(directory_, sha256));
    files::sync_path(part);
  }

  const std::string directory_;
};

}  // namespace

std::unique_ptr<ObjectStore> objects_in_directory(std::string directory) {
  return std::make_unique<DirectoryObjects>(std::move(directory));
}

}  // namespace storage::objects
