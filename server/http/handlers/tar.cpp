/// Tar archives of stored artifacts.

#include <algorithm>
#include <array>
#include <cassert>
#include <cstring>
#include <stdexcept>
#include <utility>

#include "server/http/handlers/handlers.h"
#include "tracer/sha256.h"

namespace http::handlers {
namespace {

constexpr std::uint64_t block = 512;

using Header = std::array<char, block>;

std::uint64_t padded(std::uint64_t bytes) { return (bytes + block - 1) / block * block; }

/// Octal digits up to a NUL, which is the field's last byte.
void write_octal(Header& header, std::size_t at, std::size_t size, std::uint64_t value) {
  for (std::size_t i = size - 1; i-- > 0; value /= 8) header.at(at + i) = static_cast<char>('0' + value % 8);
}

Header header_of(const TarEntry& entry) {
  assert(entry.name.size() <= 100);
  Header header{};
  std::memcpy(header.data(), entry.name.data(), entry.name.size());
  write_octal(header, 100, 8, 0644);
  write_octal(header, 108, 8, 0);  // owner and group
  write_octal(header, 116, 8, 0);
  write_octal(header, 124, 12, entry.bytes);
  write_octal(header, 136, 12, static_cast<std::uint64_t>(std::max<std::int64_t>(entry.modified / 1000, 0)));
  header[156] = '0';  // an ordinary file
  std::memcpy(header.data() + 257, "ustar", 6);
  std::memcpy(header.data() + 263, "00", 2);
  std::memset(header.data() + 148, ' ', 8);  // the checksum is computed with blanks in its own field
  std::uint64_t sum = 0;
  for (const char c : header) sum += static_cast<unsigned char>(c);
  write_octal(header, 148, 7, sum);
  return header;
}

class Archive {
 public:
  Archive(std::vector<TarEntry> entries, OpenArtifact open) : entries_(std::move(entries)), open_(std::move(open)) {
    std::uint64_t at = 0;
    for (const TarEntry& entry : entries_) {
      begins_.push_back(at);
      at += block + padded(entry.bytes);
    }
    size_ = at + 2 * block;  // the end marker: two empty blocks
  }
  [[nodiscard]] std::uint64_t size() const { return size_; }

  /// Reads the rest of a header, of an artifact or of its padding.
  std::size_t read_piece(std::uint64_t offset, char* into, std::size_t size) {
    const auto after = std::ranges::upper_bound(begins_, offset);
    if (after == begins_.begin()) return zeros(into, size, size_ - offset);
    const auto index = static_cast<std::size_t>(after - begins_.begin()) - 1;
    const TarEntry& entry = entries_[index];
    const std::uint64_t within = offset - begins_[index];
    if (within < block) {
      const Header header = header_of(entry);
      const std::size_t count = std::min<std::uint64_t>(size, block - within);
      std::memcpy(into, header.data() + within, count);
      return count;
    }
    const std::uint64_t at = within - block;
    if (at >= entry.bytes) {
      const std::uint64_t end = index + 1 < begins_.size() ? begins_[index + 1] : size_;
      return zeros(into, size, end - offset);
    }
    const std::size_t count = reader_of(index).read(at, into, std::min<std::uint64_t>(size, entry.bytes - at));
    if (count == 0) throw std::runtime_error("artifact " + entry.artifact.sha256 + " is shorter than before");
    verify(entry, at, into, count);
    return count;
  }

 private:
  /// Hashes the bytes of an artifact in their order; a part may be read twice. At the end the hash is its name.
  void verify(const TarEntry& entry, std::uint64_t at, const char* bytes, std::size_t count) {
    const std::uint64_t done = hash_.size_bytes();
    if (at > done || at + count <= done) return;
    hash_.add(bytes + (done - at), at + count - done);
    if (at + count == entry.bytes && hash_.hex() != entry.artifact.sha256)
      throw std::runtime_error("artifact " + entry.artifact.sha256 + " is damaged");
  }

  static std::size_t zeros(char* into, std::size_t size, std::uint64_t left) {
    const std::size_t count = std::min<std::uint64_t>(size, left);
    std::memset(into, 0, count);
    return count;
  }

  queue::ArtifactReader& reader_of(std::size_t index) {
    if (reader_ == nullptr || opened_ != index) {
      reader_ = open_(entries_[index].artifact);
      opened_ = index;
      hash_ = {};
      if (reader_ == nullptr) throw std::runtime_error("artifact " + entries_[index].artifact.sha256 + " is missing");
    }
    return *reader_;
  }

  std::vector<TarEntry> entries_;
  std::vector<std::uint64_t> begins_;  ///< offsets of the headers
  std::uint64_t size_ = 0;
  OpenArtifact open_;
  std::unique_ptr<queue::ArtifactReader> reader_;
  std::size_t opened_ = 0;
  tracer::Sha256 hash_;  ///< the bytes read from the open artifact
};

}  // namespace

BodySource tar_of(std::vector<TarEntry> entries, OpenArtifact open) {
  return body_in_pieces(std::make_shared<Archive>(std::move(entries), std::move(open)));
}

}  // namespace http::handlers
