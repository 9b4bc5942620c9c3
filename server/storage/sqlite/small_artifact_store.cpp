#include "server/storage/sqlite/small_artifact_store.h"

#include <unistd.h>

#include <array>
#include <utility>

#include "server/storage/sqlite/connections.h"
#include "tracer/sha256.h"

namespace storage::sqlite {
namespace {

constexpr std::size_t small_bytes_max = 32u << 10;

/// The whole content if it is small and can be read.
std::optional<std::string> read_small(int fd) {
  std::array<char, small_bytes_max + 1> bytes;
  std::size_t size = 0;
  while (size < bytes.size()) {
    const ssize_t got = ::pread(fd, bytes.data() + size, bytes.size() - size, static_cast<off_t>(size));
    if (got < 0) return std::nullopt;
    if (got == 0) return std::string(bytes.data(), size);
    size += static_cast<std::size_t>(got);
  }
  return std::nullopt;
}

std::optional<std::string> read_row(Database& database, const std::string& sha256) {
  Query row = database.query("SELECT bytes FROM small_artifacts WHERE sha256 = ?", sha256);
  if (!row.row()) return std::nullopt;
  return row.text(0);
}

class BytesReader final : public queue::ArtifactReader {
 public:
  explicit BytesReader(std::string bytes) : bytes_(std::move(bytes)) {}
  [[nodiscard]] std::uint64_t size_bytes() const override { return bytes_.size(); }
  std::size_t read(std::uint64_t offset, char* into, std::size_t size) const override {
    return offset >= bytes_.size() ? 0 : bytes_.copy(into, size, offset);
  }

 private:
  const std::string bytes_;
};

}  // namespace

queue::ArtifactStore::Stored SmallArtifactStore::put(int fd, bool durable) {
  const std::optional<std::string> bytes = read_small(fd);
  if (!bytes) return large_.put(fd, durable);
  const std::string sha256 = tracer::sha256_hex(*bytes);
  const auto work = [&](Database& database) {
    return database.change("INSERT INTO small_artifacts VALUES (?, ?) ON CONFLICT DO NOTHING", sha256, Blob{*bytes});
  };
  connections_.writer.run(work, Synced::with_next);
  return {sha256, bytes->size()};
}

void SmallArtifactStore::sync(const std::string& sha256) {
  if (!find(sha256)) large_.sync(sha256);
}

std::unique_ptr<queue::ArtifactReader> SmallArtifactStore::open(const std::string& sha256) {
  std::optional<std::string> bytes = find(sha256);
  if (!bytes) return large_.open(sha256);
  return std::make_unique<BytesReader>(*std::move(bytes));
}

void SmallArtifactStore::remove(const std::string& sha256) {
  if (!find(sha256)) return large_.remove(sha256);
  const auto work = [&](Database& database) {
    return database.change("DELETE FROM small_artifacts WHERE sha256 = ?", sha256);
  };
  connections_.writer.run(work, Synced::with_next);
}

std::optional<std::string> SmallArtifactStore::find(const std::string& sha256) {
  return connections_.reader.run([&](Database& database) { return read_row(database, sha256); });
}

}  // namespace storage::sqlite
