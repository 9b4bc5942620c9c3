#pragma once
/// A glTF file being read: its JSON, its buffers, and the first thing that is wrong with it.

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "api/src/gltf/container.h"
#include "api/src/json/tape.h"
#include "api/src/reader/cursor.h"

namespace api::gltf {

/// Elements of one of the file's top-level arrays, each with its place.
struct List {
  std::optional<Cursor> array;
  std::vector<Cursor> elements;
};

/// One element and what its rows are made of (section 5.1).
struct Accessor {
  enum class Component : std::uint16_t {
    int8 = 5120,
    uint8 = 5121,
    int16 = 5122,
    uint16 = 5123,
    uint32 = 5125,
    float32 = 5126
  };
  Component component = Component::float32;
  std::size_t components = 1;  ///< of a row
  bool normalized = false;
  std::size_t stride = 0;  ///< bytes from row to row
  std::size_t count = 0;   ///< rows, at least one
  Bytes bytes{};           ///< from the first row's first byte; holds all rows

  [[nodiscard]] double value(std::size_t row, std::size_t i) const;  ///< as section 3.6.2.2 says of `normalized`
  [[nodiscard]] std::uint32_t index(std::size_t row) const;          ///< precondition: unsigned
};

struct BufferView {
  Bytes bytes;
  std::size_t stride = 0;  ///< 0: rows follow each other
};

/// Cursors point into it: it stays where it is.
class File {
 public:
  File(json::Tape tape, std::optional<Bytes> binary);
  File(const File&) = delete;
  File& operator=(const File&) = delete;

  /// Lists and buffers; false when one of them is wrong.
  bool open();

  [[nodiscard]] const Cursor& root() const { return root_; }
  [[nodiscard]] const List& meshes() const { return meshes_; }
  [[nodiscard]] const List& nodes() const { return nodes_; }

  std::optional<Cursor> member(const Cursor& at, std::string_view name);
  /// Members of an array by number; false when it is none.
  bool elements(const Cursor& array, std::vector<Cursor>& elements);
  /// A top-level array; none where it is absent.
  bool list(std::string_view name, List& list);
  /// An integer in [0, most].
  bool integer(const Cursor& at, std::uint64_t most, std::uint64_t& value);
  /// The same of a member, which keeps its value where it is absent.
  bool optional_integer(const Cursor& at, std::string_view name, std::uint64_t most, std::uint64_t& value);
  bool required_integer(const Cursor& at, std::string_view name, std::uint64_t most, std::uint64_t& value);
  /// Exactly as many finite numbers.
  bool numbers(const Cursor& at, std::span<double> values);

  /// The accessor that the value at `at` is the index of. Each is read once, however often it is named.
  const Accessor* accessor(const Cursor& at);

  bool refuse(const Cursor& at, std::string_view sentence);  ///< always false; the first is kept
  [[nodiscard]] const std::string& refusal() const { return refusal_; }

  static constexpr std::uint64_t index_max = std::numeric_limits<std::uint32_t>::max() - 1;

 private:
  bool read_buffer(const Cursor& at);
  bool read_view(const Cursor& at);
  bool read_accessor(const Cursor& at, Accessor& accessor);
  bool read_layout(const Cursor& at, Accessor& accessor);

  json::Tape tape_;
  std::optional<Bytes> binary_;
  Cursor root_;
  List buffer_list_, view_list_, accessor_list_, meshes_, nodes_;
  std::vector<std::vector<std::uint8_t>> decoded_;  ///< of data: URIs
  std::vector<Bytes> buffers_;
  std::vector<BufferView> views_;
  std::vector<std::optional<Accessor>> accessors_;
  std::string refusal_;
};

}  // namespace api::gltf
