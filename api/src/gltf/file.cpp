#include "api/src/gltf/file.h"

#include <cmath>
#include <utility>

#include "api/src/gltf/base64.h"
#include "api/src/reader/issue_text.h"

namespace api::gltf {

File::File(json::Tape tape, std::optional<Bytes> binary) : tape_(std::move(tape)), binary_(binary) {
  root_.node = tape_.root();
}

bool File::open() {
  for (const auto& [name, into] : {std::pair{"buffers", &buffer_list_},
                                   {"bufferViews", &view_list_},
                                   {"accessors", &accessor_list_},
                                   {"meshes", &meshes_},
                                   {"nodes", &nodes_}})
    if (!list(name, *into)) return false;
  decoded_.reserve(buffer_list_.elements.size());  // what the buffers point at stays where it is
  for (const Cursor& buffer : buffer_list_.elements)
    if (!read_buffer(buffer)) return false;
  for (const Cursor& view : view_list_.elements)
    if (!read_view(view)) return false;
  accessors_.resize(accessor_list_.elements.size());
  return true;
}

std::optional<Cursor> File::member(const Cursor& at, std::string_view name) {
  if (at.node->kind != json::Kind::object) return std::nullopt;
  json::Node* key = at.node + 1;
  for (std::size_t i = 0; i < at.node->size; ++i, key = tape_.next(key + 1))
    if (key->string() == name) return Cursor{&at, key->string(), 0, true, key + 1};
  return std::nullopt;
}

bool File::elements(const Cursor& array, std::vector<Cursor>& elements) {
  if (array.node->kind != json::Kind::array) return refuse(array, "must be an array, got " + describe(*array.node));
  elements.reserve(array.node->size);
  json::Node* element = array.node + 1;
  for (std::size_t i = 0; i < array.node->size; ++i, element = tape_.next(element))
    elements.push_back({&array, {}, i, false, element});
  return true;
}

bool File::list(std::string_view name, List& list) {
  list.array = member(root_, name);
  return !list.array || elements(*list.array, list.elements);
}

bool File::integer(const Cursor& at, std::uint64_t most, std::uint64_t& value) {
  const double number = at.node->kind == json::Kind::number ? at.node->number : -1;
  // 2^53 and beyond a double has gaps.
  if (!(number >= 0 && number < 0x1p53 && number == std::trunc(number) && number <= static_cast<double>(most))) {
    return refuse(at, "must be an integer from 0 to " + std::to_string(most) + ", got " + describe(*at.node));
  }
  value = static_cast<std::uint64_t>(number);
  return true;
}

bool File::optional_integer(const Cursor& at, std::string_view name, std::uint64_t most, std::uint64_t& value) {
  const auto field = member(at, name);
  return !field || integer(*field, most, value);
}

bool File::required_integer(const Cursor& at, std::string_view name, std::uint64_t most, std::uint64_t& value) {
  const auto field = member(at, name);
  return field ? integer(*field, most, value) : refuse(at, "must have " + quoted(name));
}

bool File::numbers(const Cursor& at, std::span<double> values) {
  const std::string expected = "must be " + std::to_string(values.size()) + " finite numbers";
  if (at.node->kind != json::Kind::array || at.node->size != values.size()) return refuse(at, expected);
  json::Node* element = at.node + 1;
  for (double& value : values) {
    if (element->kind != json::Kind::number || !std::isfinite(element->number)) return refuse(at, expected);
    value = element->number;
    element = tape_.next(element);
  }
  return true;
}

bool File::read_buffer(const Cursor& at) {
  std::uint64_t size = 0;
  if (!required_integer(at, "byteLength", index_max, size)) return false;
  Bytes bytes;
  if (const auto uri = member(at, "uri")) {
    const std::string_view text = uri->node->kind == json::Kind::string ? uri->node->string() : "";
    const std::size_t comma = text.find(";base64,");
    if (!text.starts_with("data:") || comma == std::string_view::npos) {
      return refuse(*uri,
                    "names another file, which is not opened: a mesh must be one file, a GLB or with its buffers "
                    "as base64 in data: URIs");
    }
    auto decoded = decode_base64(text.substr(comma + 8));
    if (!decoded) return refuse(*uri, "is no base64");
    bytes = decoded_.emplace_back(std::move(*decoded));
  } else if (binary_ && buffers_.empty()) {
    bytes = *binary_;  // section 4.4.3.3: the first buffer alone, where it has no uri
  } else {
    return refuse(at, "has neither a uri nor a GLB's binary chunk");
  }
  if (size > bytes.size())
    return refuse(at, "declares " + std::to_string(size) + " bytes, there are " + std::to_string(bytes.size()));
  buffers_.push_back(bytes.first(size));
  return true;
}

bool File::read_view(const Cursor& at) {
  std::uint64_t buffer = 0, offset = 0, size = 0, stride = 0;
  if (buffers_.empty()) return refuse(at, "there are no buffers");
  if (!required_integer(at, "buffer", buffers_.size() - 1, buffer) ||
      !optional_integer(at, "byteOffset", index_max, offset) || !required_integer(at, "byteLength", index_max, size) ||
      !optional_integer(at, "byteStride", 252, stride))
    return false;
  const Bytes bytes = buffers_[buffer];
  if (offset > bytes.size() || size > bytes.size() - offset) {
    return refuse(at,
                  "ends at byte " + std::to_string(offset + size) + ", its buffer has " + std::to_string(bytes.size()));
  }
  views_.push_back({bytes.subspan(offset, size), stride});
  return true;
}

bool File::refuse(const Cursor& at, std::string_view sentence) {
  const std::string place = pointer(at);
  if (refusal_.empty()) refusal_ = (place.empty() ? "its JSON" : place) + ": " + std::string(sentence);
  return false;
}

}  // namespace api::gltf
