#include "api/src/gltf/file.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <utility>

#include "api/reader/issue_text.h"

namespace api::gltf {
namespace {

constexpr std::size_t header_bytes = 12;           // magic, version, length of the file
constexpr std::size_t chunk_header_bytes = 8;      // length, kind
constexpr std::uint32_t json_kind = 0x4e4f534a;    // "JSON"
constexpr std::uint32_t binary_kind = 0x004e4942;  // "BIN\0"

/// A little-endian number (sections 3.6.1.1 and 4.4.1).
std::uint32_t bits_at(Bytes bytes, std::size_t offset, std::size_t size = 4) {
  std::uint32_t bits = 0;
  for (std::size_t i = size; i-- > 0;) bits = bits << 8U | bytes[offset + i];
  return bits;
}

std::string_view text_of(Bytes bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};  // the same bytes as characters
}

[[noreturn]] void refuse_at_byte(std::size_t offset, const std::string& sentence) {
  throw GltfError("byte " + std::to_string(offset) + ": " + sentence);
}

/// The content of the chunk at `offset`.
Bytes chunk_at(Bytes bytes, std::size_t offset, const char* which) {
  const std::size_t left = bytes.size() - offset;
  if (left < chunk_header_bytes || bits_at(bytes, offset) > left - chunk_header_bytes)
    refuse_at_byte(offset, std::string("the file ends within its ") + which + " chunk");
  return bytes.subspan(offset + chunk_header_bytes, bits_at(bytes, offset));
}

Container open_glb(Bytes bytes) {
  if (bytes.size() < header_bytes) refuse_at_byte(bytes.size(), "the file ends within its header");
  if (const std::uint32_t version = bits_at(bytes, 4); version != 2)
    refuse_at_byte(4, "must be version 2 of GLB, got " + std::to_string(version));
  const std::uint32_t size = bits_at(bytes, 8);
  if (size < header_bytes || size > bytes.size()) {
    refuse_at_byte(8, "declares " + std::to_string(size) + " bytes, the file has " + std::to_string(bytes.size()));
  }
  bytes = bytes.first(size);
  const Bytes content = chunk_at(bytes, header_bytes, "first");
  if (bits_at(bytes, header_bytes + 4) != json_kind) refuse_at_byte(header_bytes, "the first chunk must be JSON");
  Container container{text_of(content), header_bytes + chunk_header_bytes, std::nullopt};
  const std::size_t second = container.json_offset + content.size();
  if (second == bytes.size()) return container;
  const Bytes binary = chunk_at(bytes, second, "second");
  if (bits_at(bytes, second + 4) == binary_kind) container.binary = binary;
  return container;
}

using Component = Accessor::Component;

std::size_t bytes_of(Component component) {
  if (component <= Component::uint8) return 1;
  return component <= Component::uint16 ? 2 : 4;
}

std::uint32_t bits_at(const Accessor& accessor, std::size_t row, std::size_t i) {
  const std::size_t size = bytes_of(accessor.component);
  return bits_at(accessor.bytes, row * accessor.stride + i * size, size);
}

/// Types of rows and their components. Those of matrices are floats, so that no column is padded.
constexpr std::pair<std::string_view, std::size_t> types[] = {{"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4},
                                                              {"MAT2", 4},   {"MAT3", 9}, {"MAT4", 16}};

/// Wider than for scene documents: a buffer may be one string, and `extras` may contain anything.
constexpr DocumentLimits json_limits{.bytes = 256'000'000, .depth = 64, .string_bytes = 256'000'000, .key_bytes = 4096};

json::Tape parse(const Container& container) {
  auto tape = json::parse(container.json, json_limits);
  if (!tape)
    throw GltfError("byte " + std::to_string(container.json_offset + tape.error().offset) + ": " + tape.error().detail);
  return *std::move(tape);
}

std::string_view string_at(const Cursor& at) {
  return at.node->kind == json::Kind::string ? at.node->string() : std::string_view();
}

}  // namespace

bool is_glb(Bytes bytes) { return text_of(bytes).starts_with("glTF"); }

Container open_container(Bytes bytes) {
  return is_glb(bytes) ? open_glb(bytes) : Container{text_of(bytes), 0, std::nullopt};
}

std::optional<std::vector<std::uint8_t>> decode_base64(std::string_view text) {
  constexpr std::string_view digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  if (text.size() % 4 == 0)
    for (int padding = 0; padding < 2 && text.ends_with('='); ++padding) text.remove_suffix(1);
  if (text.size() % 4 == 1) return std::nullopt;
  std::array<std::uint8_t, 256> value_of{};
  value_of.fill(64);
  for (std::size_t i = 0; i < 64; ++i) value_of[static_cast<unsigned char>(digits[i])] = static_cast<std::uint8_t>(i);
  std::vector<std::uint8_t> bytes;
  bytes.reserve(text.size() / 4 * 3 + 2);
  std::uint32_t bits = 0;
  unsigned count = 0;
  for (const char c : text) {
    const std::uint32_t value = value_of[static_cast<unsigned char>(c)];
    if (value == 64) return std::nullopt;
    bits = bits << 6U | value;
    count += 6;
    if (count < 8) continue;
    count -= 8;
    bytes.push_back(static_cast<std::uint8_t>(bits >> count));
  }
  return bytes;
}

bool is_external(const Cursor& uri) { return !string_at(uri).starts_with("data:"); }

File::File(Bytes bytes, std::span<const Bytes> external)
    : tape_(parse(open_container(bytes))), binary_(open_container(bytes).binary), external_(external) {
  root_.node = tape_.root();
}

void File::open() {
  accessors_.resize(all("accessors").size());
  for (const Cursor& buffer : all("buffers")) read_buffer(buffer);
  for (const Cursor& view : all("bufferViews")) read_view(view);
}

const std::vector<Cursor>& File::all(std::string_view name) {
  const auto found = lists_.find(name);
  return found != lists_.end() ? found->second : lists_.emplace(name, list(root_, name)).first->second;
}

const Cursor& File::target(const Cursor& at, std::string_view name) {
  const std::vector<Cursor>& elements = all(name);
  if (elements.empty()) refuse(at, "there are no " + std::string(name));
  return elements[integer(at, elements.size() - 1)];
}

void refuse(const Cursor& at, std::string_view sentence) {
  const std::string place = pointer(at);
  throw GltfError((place.empty() ? "its JSON" : place) + ": " + std::string(sentence));
}

std::optional<Cursor> File::member(const Cursor& at, std::string_view name) {
  json::Node* const key = tape_.find_key(at.node, name);
  return key == nullptr ? std::nullopt : std::optional(Cursor{&at, key->string(), 0, true, key + 1});
}

Cursor File::required_member(const Cursor& at, std::string_view name) {
  const auto found = member(at, name);
  if (!found) refuse(at, "must have " + quoted(name));
  return *found;
}

std::vector<Cursor> File::elements(const Cursor& array) {
  if (array.node->kind != json::Kind::array) refuse(array, "must be an array, got " + describe(*array.node));
  std::vector<Cursor> elements;
  const Cursor& parent = arrays_.emplace_back(array);
  elements.reserve(array.node->size);
  json::Node* element = array.node + 1;
  for (std::size_t i = 0; i < array.node->size; ++i, element = tape_.next(element))
    elements.push_back({&parent, {}, i, false, element});
  return elements;
}

std::vector<Cursor> File::members(const Cursor& at) {
  std::vector<Cursor> members;
  if (at.node->kind != json::Kind::object) return members;
  const Cursor& parent = arrays_.emplace_back(at);
  json::Node* key = at.node + 1;
  for (std::size_t i = 0; i < at.node->size; ++i, key = tape_.next(key + 1))
    members.push_back({&parent, key->string(), 0, true, key + 1});
  return members;
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
}

std::uint64_t File::integer_or(const Cursor& at, std::string_view name, std::uint64_t most, std::uint64_t fallback) {
  const auto field = member(at, name);
  return field ? integer(*field, most) : fallback;
}

std::uint64_t File::required_integer(const Cursor& at, std::string_view name, std::uint64_t most) {
  return integer(required_member(at, name), most);
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

double File::number(const Cursor& at, double least, double most) {
  const double value = at.node->kind == json::Kind::number ? at.node->number : std::numeric_limits<double>::quiet_NaN();
  if (value >= least && value <= most && std::isfinite(value)) return value;
  refuse(at,
         "must be a number from " + number_text(least) + " to " + number_text(most) + ", got " + describe(*at.node));
}

double File::number_or(const Cursor& at, std::string_view name, double least, double most, double fallback) {
  const auto field = member(at, name);
  return field ? number(*field, least, most) : fallback;
}

std::string File::text_or(const Cursor& at, std::string_view name, std::string fallback) {
  const auto field = member(at, name);
  if (!field) return fallback;
  if (field->node->kind != json::Kind::string) refuse(*field, "must be a string, got " + describe(*field->node));
  return std::string(field->node->string());
}

std::optional<Cursor> File::extension(const Cursor& at, std::string_view name) {
  const auto extensions = member(at, "extensions");
  const auto found = extensions ? member(arrays_.emplace_back(*extensions), name) : std::nullopt;
  if (found && found->node->kind != json::Kind::object) refuse(*found, "must be an object");
  return found;
}

Bytes File::decoded_uri(const Cursor& uri) {
  const std::string_view text = string_at(uri);
  const std::size_t comma = text.find(";base64,");
  auto decoded = comma == std::string_view::npos ? std::nullopt : decode_base64(text.substr(comma + 8));
  if (!decoded) refuse(uri, "is no base64");
  return decoded_.emplace_back(std::move(*decoded));
}

std::optional<Bytes> File::image(const Cursor& at) {
  if (const auto uri = member(at, "uri")) return is_external(*uri) ? std::nullopt : std::optional(decoded_uri(*uri));
  if (views_.empty()) refuse(at, "there are no bufferViews");
  return views_[required_integer(at, "bufferView", views_.size() - 1)].bytes;
}

void File::read_buffer(const Cursor& at) {
  const std::uint64_t size = required_integer(at, "byteLength", index_max);
  Bytes bytes;
  if (const auto uri = member(at, "uri")) {
    if (is_external(*uri) && external_.empty())
      refuse(*uri, "names another file: import the model, or name the files of its buffers in \"buffers\" of the mesh");
    bytes = is_external(*uri) ? external_.front() : decoded_uri(*uri);
    if (is_external(*uri)) external_ = external_.subspan(1);
  } else if (binary_ && buffers_.empty()) {
    bytes = *binary_;  // section 4.4.3.3: the first buffer alone, if it has no uri
  } else {
    refuse(at, "has neither a uri nor a GLB's binary chunk");
  }
  if (size > bytes.size())
    refuse(at, "declares " + std::to_string(size) + " bytes, there are " + std::to_string(bytes.size()));
  buffers_.push_back(bytes.first(size));
}

void File::read_view(const Cursor& at) {
  if (buffers_.empty()) refuse(at, "there are no buffers");
  const std::uint64_t buffer = required_integer(at, "buffer", buffers_.size() - 1);
  const std::uint64_t offset = integer_or(at, "byteOffset", index_max, 0);
  const std::uint64_t size = required_integer(at, "byteLength", index_max);
  const std::uint64_t stride = integer_or(at, "byteStride", 252, 0);
  const Bytes bytes = buffers_[buffer];
  if (offset > bytes.size() || size > bytes.size() - offset)
    refuse(at, "ends at byte " + std::to_string(offset + size) + ", its buffer has " + std::to_string(bytes.size()));
  views_.push_back({bytes.subspan(offset, size), stride});
}

/// Section 3.11: a normalized signed integer c of b bits stands for max(c / (2^(b-1) - 1), -1), an unsigned one for
/// c / (2^b - 1).
double Accessor::value(std::size_t row, std::size_t i) const {
  if (!replaced.empty())
    if (const auto found = replaced.find(row); found != replaced.end()) return found->second[i];
  const std::uint32_t bits = bits_at(*this, row, i);
  const auto scaled = [&](double value, double most) { return normalized ? std::max(value / most, -1.0) : value; };
  switch (component) {
    case Component::int8:
      return scaled(static_cast<std::int8_t>(bits), 127);
    case Component::uint8:
      return scaled(bits, 255);
    case Component::int16:
      return scaled(static_cast<std::int16_t>(bits), 32767);
    case Component::uint16:
      return scaled(bits, 65535);
    case Component::float32:
      return double{std::bit_cast<float>(bits)};
    case Component::uint32:
      break;
  }
  return bits;
}

std::uint32_t Accessor::index(std::size_t row) const {
  return replaced.empty() ? bits_at(*this, row, 0) : static_cast<std::uint32_t>(value(row, 0));
}

const Accessor& File::accessor(const Cursor& at) {
  const Cursor& element = target(at, "accessors");
  std::optional<Accessor>& kept = accessors_[element.index];
  if (!kept) kept = read_accessor(element);
  return *kept;
}

/// Reads the type of a row. Cells of matrices are read as floats only.
void File::read_layout(const Cursor& at, Accessor& accessor) {
  const std::uint64_t component = required_integer(at, "componentType", index_max);
  if (component < 5120 || component > 5126 || component == 5124)
    refuse(at, "the componentType must be one of 5120 to 5123, 5125, 5126, got " + std::to_string(component));
  accessor.component = static_cast<Component>(component);
  const Cursor type = required_member(at, "type");
  const auto* const found = std::ranges::find(types, string_at(type), [](const auto& row) { return row.first; });
  if (found == std::end(types))
    refuse(type, "must be SCALAR, VEC2, VEC3, VEC4, MAT2, MAT3 or MAT4, got " + describe(*type.node));
  accessor.components = found->second;
  if (found->first.starts_with("MAT") && accessor.component != Component::float32)
    refuse(at, "matrices must be of floats");
  const auto normalized = member(at, "normalized");
  accessor.normalized = normalized && normalized->node->kind == json::Kind::boolean && normalized->node->truth;
}

Accessor File::read_accessor(const Cursor& at) {
  Accessor accessor;
  read_layout(at, accessor);
  accessor.count = required_integer(at, "count", index_max);
  if (accessor.count == 0) refuse(at, "must have a count of at least 1");
  const auto sparse = member(at, "sparse");
  if (sparse && !member(at, "bufferView")) {
    accessor.stride = 0;  // every row is the same zeros
    accessor.bytes = decoded_.emplace_back(accessor.components * bytes_of(accessor.component));
  } else {
    read_rows(at, accessor);
  }
  if (sparse) read_replaced(*sparse, accessor);
  return accessor;
}

void File::read_replaced(const Cursor& at, Accessor& accessor) {
  const Cursor indices = required_member(at, "indices"), values = required_member(at, "values");
  const std::uint64_t count = required_integer(at, "count", accessor.count);
  Accessor row{.components = 1, .count = std::max<std::size_t>(count, 1)}, value = accessor;
  const std::uint64_t component = required_integer(indices, "componentType", index_max);
  row.component = static_cast<Component>(component);
  if (row.component != Component::uint8 && row.component != Component::uint16 && row.component != Component::uint32)
    refuse(indices, "the componentType must be 5121, 5123 or 5125, got " + std::to_string(component));
  value.count = row.count;
  if (count == 0) return;
  read_rows(indices, row);
  read_rows(values, value);
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t place = row.index(i);
    if (place >= accessor.count) refuse(indices, "has the row " + std::to_string(place) + ", there are fewer");
    std::vector<double>& components = accessor.replaced[place];
    components.clear();
    for (std::size_t c = 0; c < value.components; ++c) components.push_back(value.value(i, c));
  }
}

/// Finds the rows of an accessor whose layout and count are set, in the bufferView at `at`.
void File::read_rows(const Cursor& at, Accessor& accessor) {
  if (views_.empty()) refuse(at, "there are no bufferViews");
  const std::uint64_t view = required_integer(at, "bufferView", views_.size() - 1);
  const std::uint64_t offset = integer_or(at, "byteOffset", index_max, 0);
  const auto& [bytes, stride] = views_[view];
  const std::size_t row = accessor.components * bytes_of(accessor.component);
  accessor.stride = stride == 0 ? row : stride;
  if (accessor.stride < row)
    refuse(at, "rows have " + std::to_string(row) + " bytes, but follow each other after " +
                   std::to_string(accessor.stride));
  // Each is below 2^53: the sum cannot overflow.
  const std::uint64_t end = offset + accessor.stride * (accessor.count - 1) + row;
  if (end > bytes.size())
    refuse(at, "its " + std::to_string(accessor.count) + " rows end at byte " + std::to_string(end) +
                   ", its bufferView has " + std::to_string(bytes.size()));
  accessor.bytes = bytes.subspan(offset);
}

}  // namespace api::gltf
