#include "api/src/gltf/container.h"

#include <array>

namespace api::gltf {
namespace {

constexpr std::size_t header_bytes = 12;           // magic, version, length of the file
constexpr std::size_t chunk_header_bytes = 8;      // length, kind
constexpr std::uint32_t json_kind = 0x4e4f534a;    // "JSON"
constexpr std::uint32_t binary_kind = 0x004e4942;  // "BIN\0"

std::uint32_t word_at(Bytes bytes, std::size_t offset) {
  std::uint32_t word = 0;
  for (std::size_t i = 4; i-- > 0;) word = word << 8U | bytes[offset + i];
  return word;
}

std::string_view text_of(Bytes bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};  // the same bytes as characters
}

std::string at_byte(std::size_t offset, const std::string& sentence) {
  return "byte " + std::to_string(offset) + ": " + sentence;
}

/// Sets the content of the chunk at `offset`; false if the file ends within it.
bool chunk_at(Bytes bytes, std::size_t offset, Bytes& content) {
  if (bytes.size() - offset < chunk_header_bytes) return false;
  const Bytes rest = bytes.subspan(offset + chunk_header_bytes);
  const std::uint32_t size = word_at(bytes, offset);
  if (size > rest.size()) return false;
  content = rest.first(size);
  return true;
}

tracer::Result<Container, std::string> open_glb(Bytes bytes) {
  if (bytes.size() < header_bytes) return at_byte(bytes.size(), "the file ends within its header");
  if (const std::uint32_t version = word_at(bytes, 4); version != 2)
    return at_byte(4, "must be version 2 of GLB, got " + std::to_string(version));
  const std::uint32_t size = word_at(bytes, 8);
  if (size < header_bytes || size > bytes.size()) {
    return at_byte(8, "declares " + std::to_string(size) + " bytes, the file has " + std::to_string(bytes.size()));
  }
  bytes = bytes.first(size);
  Bytes content;
  if (!chunk_at(bytes, header_bytes, content)) return at_byte(header_bytes, "the file ends within its first chunk");
  if (word_at(bytes, header_bytes + 4) != json_kind) return at_byte(header_bytes, "the first chunk must be JSON");
  Container container{text_of(content), header_bytes + chunk_header_bytes, std::nullopt};
  const std::size_t second = container.json_offset + content.size();
  if (second == bytes.size()) return container;
  if (!chunk_at(bytes, second, content)) return at_byte(second, "the file ends within its second chunk");
  if (word_at(bytes, second + 4) == binary_kind) container.binary = content;
  return container;
}

}  // namespace

bool is_glb(Bytes bytes) { return text_of(bytes).starts_with("glTF"); }

tracer::Result<Container, std::string> open_container(Bytes bytes) {
  if (is_glb(bytes)) return open_glb(bytes);
  return Container{text_of(bytes), 0, std::nullopt};
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

}  // namespace api::gltf
