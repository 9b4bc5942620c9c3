/// Animated PNG (APNG, PNG third edition, section 11.3.6) of stored PNG images, without a decoder: the data of each
/// frame is that of its file, in chunks of another name.

#include <zlib.h>

#include <algorithm>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "server/http/handlers/handlers.h"

namespace http::handlers {
namespace {

constexpr std::uint64_t signature_bytes = 8, chunk_overhead = 12;  // length, name and CRC

std::uint32_t number_at(std::string_view bytes, std::size_t at) {
  std::uint32_t value = 0;
  for (const char byte : bytes.substr(at, 4)) value = value << 8 | static_cast<unsigned char>(byte);
  return value;
}

std::string text_of(std::uint32_t value) {
  return {static_cast<char>(value >> 24), static_cast<char>(value >> 16), static_cast<char>(value >> 8),
          static_cast<char>(value)};
}

std::uint32_t crc_of(std::string_view text) {
  return static_cast<std::uint32_t>(::crc32_z(0, reinterpret_cast<const unsigned char*>(text.data()), text.size()));
}

std::string chunk(const std::string& name_and_data) {
  return text_of(static_cast<std::uint32_t>(name_and_data.size() - 4)) + name_and_data + text_of(crc_of(name_and_data));
}

/// Bytes of the animation: text, or a part of an image.
struct Piece {
  std::uint64_t begin = 0;
  std::string text;
  std::size_t image = 0;
  std::uint64_t offset = 0, bytes = 0;  ///< part of the image; 0 bytes: text
};

class Animation {
 public:
  Animation(std::size_t images, OpenFrame open, int frames_per_second)
      : images_(images), open_(std::move(open)), frames_per_second_(frames_per_second) {}

  /// False if the images differ in size or kind. Throws std::runtime_error if one is missing or no PNG.
  bool plan() {
    for (std::size_t i = 0; i < images_; ++i)
      if (!add_frame(i)) return false;
    add_text(chunk("IEND"));
    return true;
  }
  [[nodiscard]] std::uint64_t size() const { return size_; }

  std::size_t read_piece(std::uint64_t offset, char* into, std::size_t size) {
    const auto after = std::ranges::upper_bound(pieces_, offset, {}, &Piece::begin);
    const Piece& piece = *std::prev(after);
    const std::uint64_t within = offset - piece.begin;
    if (piece.bytes == 0) return piece.text.copy(into, size, within);
    const std::size_t wanted = std::min<std::uint64_t>(size, piece.bytes - within);
    const std::size_t count = reader_of(piece.image).read(piece.offset + within, into, wanted);
    if (count == 0) throw std::runtime_error(name_of(piece.image) + " is shorter than before");
    return count;
  }

 private:
  void add_text(std::string text) {
    const std::uint64_t bytes = text.size();
    pieces_.push_back({size_, std::move(text), 0, 0, 0});
    size_ += bytes;
  }

  bool add_frame(std::size_t index) {
    std::string head;  // all chunks before the first of data
    bool begun = false;
    for (std::uint64_t at = signature_bytes;;) {
      const std::string start = bytes_of(index, at, 8);
      const std::uint64_t bytes = number_at(start, 0);
      const std::string name = start.substr(4);
      if (name == "IEND") break;
      if (name == "IDAT") {
        if (!begun && !begin_frame(index, head)) return false;
        begun = true;
        add_data(index, at, bytes);
      } else if (!begun) {
        head += bytes_of(index, at, chunk_overhead + bytes);
      }
      at += chunk_overhead + bytes;
    }
    return begun;
  }

  bool begin_frame(std::size_t index, const std::string& head) {
    if (index == 0) {
      head_ = head;
      add_text(bytes_of(0, 0, signature_bytes) + head +
               chunk("acTL" + text_of(static_cast<std::uint32_t>(images_)) + text_of(0)));
    }
    if (head != head_ || head.size() < 16) return false;
    // Size as in IHDR, no offset, 1/fps seconds, replaces the frame before.
    const std::string delay{0, 1, 0, static_cast<char>(frames_per_second_), 0, 0};
    add_text(chunk("fcTL" + text_of(next_number_++) + head.substr(8, 8) + std::string(8, '\0') + delay));
    return true;
  }

  /// The first frame keeps its chunks. The CRC of the others follows from the old one, so that damage stays visible.
  void add_data(std::size_t index, std::uint64_t at, std::uint64_t bytes) {
    if (index == 0) return add_bytes(index, at, chunk_overhead + bytes);
    const std::string name = "fdAT" + text_of(next_number_++);
    const std::uint32_t old_crc = number_at(bytes_of(index, at + 8 + bytes, 4), 0);
    add_text(text_of(static_cast<std::uint32_t>(bytes + 4)) + name);
    add_bytes(index, at + 8, bytes);
    // The CRC is linear: combined with that of nothing, the difference of the names is moved before the data.
    const auto change = ::crc32_combine(crc_of("IDAT") ^ crc_of(name), 0, static_cast<z_off_t>(bytes));
    add_text(text_of(old_crc ^ static_cast<std::uint32_t>(change)));
  }

  void add_bytes(std::size_t index, std::uint64_t offset, std::uint64_t bytes) {
    if (bytes == 0) return;
    pieces_.push_back({size_, {}, index, offset, bytes});
    size_ += bytes;
  }

  std::string bytes_of(std::size_t index, std::uint64_t offset, std::uint64_t count) {
    const queue::ArtifactReader& image = reader_of(index);
    if (count > image.size_bytes()) throw std::runtime_error(name_of(index) + " is no PNG");
    std::string bytes(count, '\0');
    if (image.read(offset, bytes.data(), count) != count) throw std::runtime_error(name_of(index) + " is no PNG");
    return bytes;
  }

  queue::ArtifactReader& reader_of(std::size_t index) {
    if (reader_ == nullptr || opened_ != index) {
      reader_ = open_(index);
      opened_ = index;
      if (reader_ == nullptr) throw std::runtime_error(name_of(index) + " is missing");
    }
    return *reader_;
  }

  static std::string name_of(std::size_t index) { return "image " + std::to_string(index) + " of the animation"; }

  const std::size_t images_;
  const OpenFrame open_;
  const int frames_per_second_;
  std::vector<Piece> pieces_;
  std::uint64_t size_ = 0;
  std::string head_;               ///< chunks of the first image before its data
  std::uint32_t next_number_ = 0;  ///< sequence number of chunks fcTL and fdAT
  std::unique_ptr<queue::ArtifactReader> reader_;
  std::size_t opened_ = 0;
};

}  // namespace

std::optional<BodySource> apng_of(std::size_t images, OpenFrame open, int frames_per_second) {
  const auto animation = std::make_shared<Animation>(images, std::move(open), frames_per_second);
  if (!animation->plan()) return std::nullopt;
  return body_in_pieces(animation);
}

}  // namespace http::handlers
