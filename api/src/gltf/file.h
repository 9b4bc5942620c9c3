#pragma once
/// A glTF file while it is read: its form (JSON text, or GLB, a container of JSON and one binary chunk), its JSON and
/// its buffers. Everything here throws GltfError for an invalid file.

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <limits>
#include <map>
#include <new>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "api/json.h"
#include "api/reader/cursor.h"
#include "api/reader/json_parser.h"
#include "tracer/result.h"
#include "tracer/scene.h"

namespace api::gltf {

using Bytes = std::span<const std::uint8_t>;

/// A sentence for people that begins with the place. An exception, because a reader can fail at every value; read_gltf
/// returns it as a value.
struct GltfError : std::runtime_error {
  using std::runtime_error::runtime_error;
};
[[noreturn]] void refuse(const Cursor& at, std::string_view sentence);

/// The result of `work`, or the sentence of its GltfError.
template <class Work>
tracer::Result<std::invoke_result_t<Work>, std::string> result_of(const Work& work) {
  try {
    return work();
  } catch (const GltfError& error) {
    return std::string(error.what());
  } catch (const std::bad_alloc&) {
    return std::string("takes more memory than is available");
  }
}

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
  /// Rows whose values replace those of `bytes` (section 3.6.2.3), by row; and their components.
  std::map<std::size_t, std::vector<double>> replaced{};

  [[nodiscard]] double value(std::size_t row, std::size_t i) const;  ///< `normalized` applied (section 3.6.2.2)
  [[nodiscard]] std::uint32_t index(std::size_t row) const;          ///< precondition: unsigned
};

/// True for the URI of a file of its own: any but data:.
bool is_external(const Cursor& uri);

/// Not movable, because cursors point into it.
class File {
 public:
  /// `external`: contents of the buffers that are files of their own, in order. `bytes` and `external` must outlive it.
  File(Bytes bytes, std::span<const Bytes> external);
  File(File&&) = delete;

  void open();  ///< reads the buffers

  [[nodiscard]] const Cursor& root() const { return root_; }
  const std::vector<Cursor>& all(std::string_view list);  ///< elements of a top-level list: "nodes"
  /// The element of such a list that the value at `at` is the index of.
  const Cursor& target(const Cursor& at, std::string_view list);

  std::optional<Cursor> member(const Cursor& at, std::string_view name);
  Cursor required_member(const Cursor& at, std::string_view name);
  std::vector<Cursor> elements(const Cursor& array);
  std::vector<Cursor> members(const Cursor& at);                      ///< none of a value that is no object
  std::vector<Cursor> list(const Cursor& at, std::string_view name);  ///< elements of a member that may be missing
  std::uint64_t integer(const Cursor& at, std::uint64_t most);        ///< in [0, most]
  std::uint64_t integer_or(const Cursor& at, std::string_view name, std::uint64_t most, std::uint64_t fallback);
  std::uint64_t required_integer(const Cursor& at, std::string_view name, std::uint64_t most);
  void numbers(const Cursor& at, std::span<double> values);  ///< exactly that many finite numbers
  double number(const Cursor& at, double least, double most);
  double number_or(const Cursor& at, std::string_view name, double least, double most, double fallback);
  std::string text_or(const Cursor& at, std::string_view name, std::string fallback);
  std::optional<Cursor> extension(const Cursor& at, std::string_view name);

  const Accessor& accessor(const Cursor& at);  ///< whose index is the value at `at`; each is read once
  /// Content of an image in a buffer or a data: URI; none if it is a file of its own.
  std::optional<Bytes> image(const Cursor& at);

  static constexpr std::uint64_t index_max = std::numeric_limits<std::uint32_t>::max() - 1;

 private:
  struct BufferView {
    Bytes bytes;
    std::size_t stride = 0;  ///< 0: rows are contiguous
  };
  void read_buffer(const Cursor& at);
  void read_view(const Cursor& at);
  void read_layout(const Cursor& at, Accessor& accessor);
  void read_rows(const Cursor& at, Accessor& accessor);
  void read_replaced(const Cursor& at, Accessor& accessor);
  Accessor read_accessor(const Cursor& at);
  Bytes decoded_uri(const Cursor& uri);

  json::Tape tape_;
  std::optional<Bytes> binary_;
  std::span<const Bytes> external_;
  Cursor root_;
  std::deque<Cursor> arrays_;  ///< parents of elements and extensions
  std::map<std::string, std::vector<Cursor>, std::less<>> lists_;
  std::deque<std::vector<std::uint8_t>> decoded_;  ///< contents of data: URIs, and rows of zeros
  std::vector<Bytes> buffers_;
  std::vector<BufferView> views_;
  std::vector<std::optional<Accessor>> accessors_;
};

// ---- parts of a file

/// A node and its place in the world.
struct Placement {
  Cursor node{};
  tracer::Transform world_from_node{};
  std::vector<double> weights{};          ///< those of morph targets, if the node or the animation has them
  std::vector<tracer::Transform> joints;  ///< those of a skin: world space from the mesh, by joint
};

/// Nodes in the order of a walk through the scene's tree, parents first: those of the file's scene, else all. With a
/// time in seconds, the first animation moves them (section 3.11); it has its first pose before it begins and its last
/// one after its end. A node that is reached twice, in a cycle or from two parents, is an error (section 3.5.2). Trees
/// may have any depth: there is no recursion.
std::vector<Placement> place_nodes(File& file, std::optional<double> time);

/// Parts of a model that a scene document does not have, as ends of sentences that begin with the place.
using Omit = std::function<void(const Cursor& at, std::string_view what)>;

/// The name of the glTF file in the document, and the files that it names.
struct ModelFiles {
  std::string name;
  std::function<std::string(const Cursor& uri)> path_of;  ///< path of a file, in the document
  std::function<std::optional<std::vector<std::uint8_t>>(const std::string& path)> read;  ///< none: it is unavailable
};

/// Principled materials by name, as Primitive::material has it (the first of equal names), with textures written in
/// place: images within the file by their index in it, others by their path.
Json read_materials(File& file, const ModelFiles& files, const Omit& omit);

}  // namespace api::gltf
