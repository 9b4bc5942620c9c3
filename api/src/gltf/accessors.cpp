#include <algorithm>
#include <bit>

#include "api/src/gltf/file.h"
#include "api/src/reader/issue_text.h"

namespace api::gltf {
namespace {

using Component = Accessor::Component;

std::size_t bytes_of(Component component) {
  if (component <= Component::uint8) return 1;
  return component <= Component::uint16 ? 2 : 4;
}

/// Little-endian (section 3.6.1.1).
std::uint32_t bits_at(const Accessor& accessor, std::size_t row, std::size_t i) {
  const std::size_t size = bytes_of(accessor.component);
  const std::size_t offset = row * accessor.stride + i * size;
  std::uint32_t bits = 0;
  for (std::size_t byte = size; byte-- > 0;) bits = bits << 8U | accessor.bytes[offset + byte];
  return bits;
}

constexpr std::string_view types[] = {"SCALAR", "VEC2", "VEC3", "VEC4"};  // of 1 to 4 components

}  // namespace

/// Section 3.11: a normalized signed integer c of b bits stands for max(c / (2^(b-1) - 1), -1), an unsigned one for
/// c / (2^b - 1).
double Accessor::value(std::size_t row, std::size_t i) const {
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

std::uint32_t Accessor::index(std::size_t row) const { return bits_at(*this, row, 0); }

const Accessor* File::accessor(const Cursor& at) {
  if (accessors_.empty()) refuse(at, "there are no accessors");
  const std::uint64_t index = integer(at, accessors_.size() - 1);
  if (failed()) return nullptr;
  std::optional<Accessor>& kept = accessors_[index];
  if (!kept) {
    Accessor accessor;
    if (!read_accessor(accessor_list_[index], accessor)) return nullptr;
    kept = accessor;
  }
  return &*kept;
}

/// Reads the type of a row.
bool File::read_layout(const Cursor& at, Accessor& accessor) {
  const std::uint64_t component = required_integer(at, "componentType", index_max);
  if (component < 5120 || component > 5126 || component == 5124)
    return refuse(at, "the componentType must be one of 5120 to 5123, 5125, 5126, got " + std::to_string(component));
  accessor.component = static_cast<Component>(component);
  const auto type = required_member(at, "type");
  if (!type) return false;
  const std::string_view name = type->node->kind == json::Kind::string ? type->node->string() : "";
  const auto* const found = std::find(std::begin(types), std::end(types), name);
  if (found == std::end(types))
    return refuse(*type, "must be SCALAR, VEC2, VEC3 or VEC4, got " + describe(*type->node));
  accessor.components = static_cast<std::size_t>(found - types) + 1;
  const auto normalized = member(at, "normalized");
  accessor.normalized = normalized && normalized->node->kind == json::Kind::boolean && normalized->node->truth;
  return true;
}

bool File::read_accessor(const Cursor& at, Accessor& accessor) {
  if (const auto sparse = member(at, "sparse")) return refuse(*sparse, "sparse accessors are not supported");
  if (views_.empty()) return refuse(at, "there are no bufferViews");
  if (!read_layout(at, accessor)) return false;
  const std::uint64_t view = required_integer(at, "bufferView", views_.size() - 1);
  const std::uint64_t offset = integer_or(at, "byteOffset", index_max, 0);
  accessor.count = required_integer(at, "count", index_max);
  if (failed()) return false;
  if (accessor.count == 0) return refuse(at, "must have a count of at least 1");
  const auto& [bytes, stride] = views_[view];
  const std::size_t row = accessor.components * bytes_of(accessor.component);
  accessor.stride = stride == 0 ? row : stride;
  if (accessor.stride < row)
    return refuse(at, "rows have " + std::to_string(row) + " bytes, but follow each other after " +
                          std::to_string(accessor.stride));
  // Each is below 2^53: the sum cannot overflow.
  const std::uint64_t end = offset + accessor.stride * (accessor.count - 1) + row;
  if (end > bytes.size())
    return refuse(at, "its " + std::to_string(accessor.count) + " rows end at byte " + std::to_string(end) +
                          ", its bufferView has " + std::to_string(bytes.size()));
  accessor.bytes = bytes.subspan(offset);
  return true;
}

}  // namespace api::gltf
