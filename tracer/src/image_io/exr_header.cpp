#include "tracer/src/image_io/exr_header.h"

#include <algorithm>
#include <array>
#include <stdexcept>
#include <string_view>

namespace tracer {
namespace {

constexpr std::uint32_t flag_multipart = 0x1000;

/// Rows per chunk, indexed by compression: none, RLE, ZIPS, ZIP, PIZ, PXR24, B44, B44A, DWAA, DWAB.
constexpr std::array<std::uint64_t, 10> chunk_rows{1, 1, 1, 16, 32, 16, 32, 32, 32, 256};

struct HeaderError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

class Header {
 public:
  Header(std::span<const std::uint8_t> bytes, const TextureImageLimits& limits) : left_(bytes), limits_(limits) {}

  void check() {
    take(4);
    const bool multipart = (number() & flag_multipart) != 0;
    std::uint64_t chunks = 0;
    do {
      part_ = {};
      while (!at_end_of_part()) attribute();
      chunks += part_.chunks();
    } while (multipart && !at_end_of_part());
    if (chunks > left_.size() / 8)
      throw HeaderError("is truncated: it has " + std::to_string(left_.size()) + " bytes for " +
                        std::to_string(chunks) + " chunks");
  }

 private:
  /// Attributes of one header that determine how much memory OpenEXR allocates.
  struct Part {
    std::uint64_t width = 0, height = 0, tile_width = 0, tile_height = 0, rows = 1;

    [[nodiscard]] std::uint64_t chunks() const {
      if (tile_width == 0 || tile_height == 0) return (height + rows - 1) / rows;
      return ((width + tile_width - 1) / tile_width) * ((height + tile_height - 1) / tile_height);
    }
  };

  std::span<const std::uint8_t> take(std::size_t count) {
    if (count > left_.size()) throw HeaderError("is truncated: its header is not within the file");
    const auto taken = left_.first(count);
    left_ = left_.subspan(count);
    return taken;
  }

  std::uint32_t number() {
    const auto bytes = take(4);
    std::uint32_t value = 0;
    for (std::size_t i = bytes.size(); i-- > 0;) value = value << 8U | bytes[i];
    return value;
  }

  std::string_view text() {
    const auto end = std::find(left_.begin(), left_.end(), 0);
    const auto length = static_cast<std::size_t>(end - left_.begin());
    const std::string_view text{reinterpret_cast<const char*>(left_.data()), length};
    take(length + 1);
    return text;
  }

  /// Reads the zero byte that ends a list of names.
  bool at_end_of_part() {
    if (!left_.empty() && left_.front() != 0) return false;
    take(1);
    return true;
  }

  void attribute() {
    const std::string_view name = text(), type = text();
    const std::uint32_t size = number();
    if (size > left_.size())
      throw HeaderError("is truncated: its header has an attribute of " + std::to_string(size) + " bytes, " +
                        std::to_string(left_.size()) + " are left");
    const auto rest = left_.subspan(size);
    if (name == "dataWindow" && type == "box2i") window();
    if (name == "tiles" && type == "tiledesc") tiles();
    if (name == "compression" && size > 0) part_.rows = chunk_rows[std::min<std::size_t>(left_[0], 9)];
    left_ = rest;
  }

  void window() {
    std::array<std::int64_t, 4> edges{};
    for (std::int64_t& edge : edges) edge = static_cast<std::int32_t>(number());
    const auto [left, top, right, bottom] = edges;
    if (right < left || bottom < top) throw HeaderError("has no pixels");
    part_.width = static_cast<std::uint64_t>(right - left + 1);
    part_.height = static_cast<std::uint64_t>(bottom - top + 1);
    if (part_.width * part_.height > limits_.pixels)
      throw HeaderError("the limit pixels is " + std::to_string(limits_.pixels) + ", it has " +
                        std::to_string(part_.width) + " x " + std::to_string(part_.height));
  }

  void tiles() {
    part_.tile_width = number();
    part_.tile_height = number();
    if (part_.tile_width * part_.tile_height > limits_.pixels)  // product of two 32-bit numbers: no overflow
      throw HeaderError("the limit pixels is " + std::to_string(limits_.pixels) + ", it has tiles of " +
                        std::to_string(part_.tile_width) + " x " + std::to_string(part_.tile_height));
  }

  std::span<const std::uint8_t> left_;
  const TextureImageLimits& limits_;
  Part part_;
};

}  // namespace

std::string exr_header_error(std::span<const std::uint8_t> bytes, const TextureImageLimits& limits) try {
  Header(bytes, limits).check();
  return "";
} catch (const HeaderError& error) {
  return error.what();
}

}  // namespace tracer
