#include "api/src/gltf/file.h"

#include <cmath>
#include <utility>

#include "api/src/reader/issue_text.h"

namespace api::gltf {

void File::open() {
  const std::vector<Cursor> buffers = list(root_, "buffers"), views = list(root_, "bufferViews");
  accessor_list_ = list(root_, "accessors");
  accessors_.resize(accessor_list_.size());
  meshes_ = list(root_, "meshes");
  nodes_ = list(root_, "nodes");
  for (std::size_t i = 0; i < buffers.size() && !failed(); ++i) read_buffer(buffers[i]);
  for (std::size_t i = 0; i < views.size() && !failed(); ++i) read_view(views[i]);
}

bool File::refuse(const Cursor& at, std::string_view sentence) {
  const std::string place = pointer(at);
  if (!failed()) refusal_ = (place.empty() ? "its JSON" : place) + ": " + std::string(sentence);
  return false;
}

std::optional<Cursor> File::member(const Cursor& at, std::string_view name) {
  json::Node* const key = tape_.find_key(at.node, name);
  return key == nullptr ? std::nullopt : std::optional(Cursor{&at, key->string(), 0, true, key + 1});
}

std::optional<Cursor> File::required_member(const Cursor& at, std::string_view name) {
  auto found = member(at, name);
  if (!found) refuse(at, "must have " + quoted(name));
  return found;
}

std::vector<Cursor> File::elements(const Cursor& array) {
  std::vector<Cursor> elements;
  if (array.node->kind != json::Kind::array) {
    refuse(array, "must be an array, got " + describe(*array.node));
    return elements;
  }
  const Cursor& parent = arrays_.emplace_back(array);
  elements.reserve(array.node->size);
  json::Node* element = array.node + 1;
  for (std::size_t i = 0; i < array.node->size; ++i, element = tape_.next(element))
    elements.push_back({&parent, {}, i, false, element});
  return elements;
}

std::vector<Cursor> File::list(const Cursor& at, std::string_view name) {
  const auto array = member(at, name);
  return array ? elements(*array) : std::vector<Cursor>();
}

std::uint64_t File::integer(const Cursor& at, std::uint64_t most) {
  const double number = at.node->kind == json::Kind::number ? at.node->number : -1;
  // From 2^53 on, doubles have gaps.
  if (number >= 0 && number < 0x1p53 && number == std::trunc(number) && number <= static_cast<double>(most))
    return static_cast<std::uint64_t>(number);
  refuse(at, "must be an integer from 0 to " + std::to_string(most) + ", got " + describe(*at.node));
  return 0;
}

std::uint64_t File::integer_or(const Cursor& at, std::string_view name, std::uint64_t most, std::uint64_t fallback) {
  const auto field = member(at, name);
  return field ? integer(*field, most) : fallback;
}

std::uint64_t File::required_integer(const Cursor& at, std::string_view name, std::uint64_t most) {
  const auto field = required_member(at, name);
  return field ? integer(*field, most) : 0;
}

void File::numbers(const Cursor& at, std::span<double> values) {
  bool valid = at.node->kind == json::Kind::array && at.node->size == values.size();
  json::Node* element = at.node + 1;
  for (std::size_t i = 0; valid && i < values.size(); ++i, element = tape_.next(element)) {
    valid = element->kind == json::Kind::number && std::isfinite(element->number);
    values[i] = element->number;
  }
  if (!valid) refuse(at, "must be " + std::to_string(values.size()) + " finite numbers");
}

void File::read_buffer(const Cursor& at) {
  const std::uint64_t size = required_integer(at, "byteLength", index_max);
  Bytes bytes;
  if (const auto uri = member(at, "uri")) {
    const std::string_view text = uri->node->kind == json::Kind::string ? uri->node->string() : "";
    const std::size_t comma = text.find(";base64,");
    if (!text.starts_with("data:") || comma == std::string_view::npos) {
      refuse(*uri,
             "names another file, which is not opened: a mesh must be one file, a GLB or with its buffers as "
             "base64 in data: URIs");
      return;
    }
    auto decoded = decode_base64(text.substr(comma + 8));
    if (!decoded) {
      refuse(*uri, "is no base64");
      return;
    }
    bytes = decoded_.emplace_back(std::move(*decoded));
  } else if (binary_ && buffers_.empty()) {
    bytes = *binary_;  // section 4.4.3.3: the first buffer alone, if it has no uri
  } else {
    refuse(at, "has neither a uri nor a GLB's binary chunk");
  }
  if (size > bytes.size())
    refuse(at, "declares " + std::to_string(size) + " bytes, there are " + std::to_string(bytes.size()));
  if (!failed()) buffers_.push_back(bytes.first(size));
}

void File::read_view(const Cursor& at) {
  if (buffers_.empty()) refuse(at, "there are no buffers");
  const std::uint64_t buffer = required_integer(at, "buffer", buffers_.size() - 1);
  const std::uint64_t offset = integer_or(at, "byteOffset", index_max, 0);
  const std::uint64_t size = required_integer(at, "byteLength", index_max);
  const std::uint64_t stride = integer_or(at, "byteStride", 252, 0);
  if (failed()) return;
  const Bytes bytes = buffers_[buffer];
  if (offset > bytes.size() || size > bytes.size() - offset) {
    refuse(at, "ends at byte " + std::to_string(offset + size) + ", its buffer has " + std::to_string(bytes.size()));
  } else {
    views_.push_back({bytes.subspan(offset, size), stride});
  }
}

}  // namespace api::gltf
