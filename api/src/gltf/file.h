#pragma once
/// A glTF file while it is read: its form (JSON text, or GLB, a container of JSON and one binary chunk), its JSON and
/// its buffers. Everything here throws GltfError for an invalid file.

#include <cstddef>
#include <cstdint>
#include <deque>
#include <limits>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "api/reader/cursor.h"
#include "api/reader/json_parser.h"

namespace api::gltf {

using Bytes = std::span<const std::uint8_t>;

/// A sentence for people that begins with the place. An exception, because a reader can fail at every value; read_gltf
/// returns it as a value.
struct GltfError : std::runtime_error {
  using std::runtime_error::runtime_error;
};
[[noreturn]] void refuse(const Cursor& at, std::string_view sentence);

/// Views of the file's parts.
struct Container {
  std::string_view json;
  std::size_t json_offset = 0;  ///< position of `json` in the file
  std::optional<Bytes> binary;  ///< GLB's second chunk
};

bool is_glb(Bytes bytes);

Container open_container(Bytes bytes);  ///< section 4.4

/// Decodes base64 (RFC 4648, section 4). Unset for other characters, an impossible length, or padding except at the
/// end. The padding may be missing, and unused bits may have any value.
std::optional<std::vector<std::uint8_t>> decode_base64(std::string_view text);

/// An accessor and the layout of its rows (section 5.1).
struct Accessor {
  enum class Component : std::uint16_t { int8 = 5120, uint8, int16, uint16, uint32 = 5125, float32 };
  Component component = Component::float32;
  std::size_t components = 1;  ///< per row
  bool normalized = false;
  std::size_t stride = 0;  ///< bytes from row to row
  std::size_t count = 0;   ///< rows, at least one
  Bytes bytes{};           ///< begins with the first row; contains all rows

  [[nodiscard]] double value(std::size_t row, std::size_t i) const;  ///< `normalized` applied (section 3.6.2.2)
  [[nodiscard]] std::uint32_t index(std::size_t row) const;          ///< precondition: unsigned
};

/// Not movable, because cursors point into it.
class File {
 public:
  File(json::Tape tape, std::optional<Bytes> binary) : tape_(std::move(tape)), binary_(binary) {
    root_.node = tape_.root();
  }
  File(const File&) = delete;
  File& operator=(const File&) = delete;

  void open();  ///< reads the top-level arrays and the buffers

  [[nodiscard]] const Cursor& root() const { return root_; }
  [[nodiscard]] const std::vector<Cursor>& meshes() const { return meshes_; }
  [[nodiscard]] const std::vector<Cursor>& nodes() const { return nodes_; }
  [[nodiscard]] const std::vector<Cursor>& materials() const { return materials_; }

  std::optional<Cursor> member(const Cursor& at, std::string_view name);
  Cursor required_member(const Cursor& at, std::string_view name);
  std::vector<Cursor> elements(const Cursor& array);
  std::vector<Cursor> list(const Cursor& at, std::string_view name);  ///< elements of a member that may be missing
  std::uint64_t integer(const Cursor& at, std::uint64_t most);        ///< in [0, most]
  std::uint64_t integer_or(const Cursor& at, std::string_view name, std::uint64_t most, std::uint64_t fallback);
  std::uint64_t required_integer(const Cursor& at, std::string_view name, std::uint64_t most);
  void numbers(const Cursor& at, std::span<double> values);  ///< exactly that many finite numbers

  const Accessor& accessor(const Cursor& at);  ///< whose index is the value at `at`; each is read once

  static constexpr std::uint64_t index_max = std::numeric_limits<std::uint32_t>::max() - 1;

 private:
  struct BufferView {
    Bytes bytes;
    std::size_t stride = 0;  ///< 0: rows are contiguous
  };
  void read_buffer(const Cursor& at);
  void read_view(const Cursor& at);
  void read_layout(const Cursor& at, Accessor& accessor);
  Accessor read_accessor(const Cursor& at);

  json::Tape tape_;
  std::optional<Bytes> binary_;
  Cursor root_;
  std::deque<Cursor> arrays_;  ///< parents of elements
  std::vector<Cursor> meshes_, nodes_, materials_, accessor_list_;
  std::deque<std::vector<std::uint8_t>> decoded_;  ///< contents of data: URIs
  std::vector<Bytes> buffers_;
  std::vector<BufferView> views_;
  std::vector<std::optional<Accessor>> accessors_;
};

}  // namespace api::gltf
