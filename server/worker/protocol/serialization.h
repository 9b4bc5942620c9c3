#pragma once
/// Serializes messages as their fields in order. A string is its length and its bytes, a list its length and its
/// elements; a descriptor is only a position among the files beside the packet.

#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "server/worker/protocol/protocol.h"

namespace worker {

// The order of the fields in a packet. A change requires a new protocol_version.
inline auto fields(FileSettings& m) { return std::tie(m.directory, m.uploads, m.objects, m.triangles); }
inline auto fields(Options& m) {
  return std::tie(m.slots, m.threads, m.job_memory_bytes, m.scene_cache_bytes, m.cache_idle_ms, m.files);
}
inline auto fields(Configure& m) { return std::tie(m.options); }
inline auto fields(Assign& m) { return std::tie(m.job_id, m.fence, m.queue_ms, m.document, m.kind, m.large); }
inline auto fields(Cancel& m) { return std::tie(m.job_id); }
inline auto fields(Ready& m) { return std::tie(m.build, m.sandbox); }
inline auto fields(Heartbeat& m) { return std::tie(m.geometry_bytes, m.image_bytes); }
inline auto fields(Progress& m) { return std::tie(m.job_id, m.tiles_done, m.tiles_total); }
inline auto fields(PreviewRequest& m) { return std::tie(m.job_id, m.side); }
inline auto fields(PreviewResponse& m) { return std::tie(m.job_id, m.side, m.png); }
inline auto fields(Image& m) { return std::tie(m.name, m.media_type, m.bytes); }
inline auto fields(Finished& m) { return std::tie(m.job_id, m.fence, m.report, m.images); }
inline auto fields(Failed& m) { return std::tie(m.job_id, m.fence, m.problem); }
inline auto fields(Cancelled& m) { return std::tie(m.job_id, m.fence); }
inline auto fields(queue::Problem& m) { return std::tie(m.code, m.detail, m.errors); }
inline auto fields(tracer::Issue& m) { return std::tie(m.pointer, m.code, m.detail); }

constexpr std::uint32_t protocol_version = 4;

class MessageWriter {
 public:
  template <class T>
  void write(T& value) {
    if constexpr (std::is_arithmetic_v<T>) {
      bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
    } else {
      std::apply([&](auto&... field) { (write(field), ...); }, fields(value));
    }
  }
  void write(std::string& text) {
    write_size(text.size());
    bytes_ += text;
  }
  template <class T>
  void write(std::vector<T>& list) {
    write_size(list.size());
    for (T& element : list) write(element);
  }
  void write(Descriptor& file) { files_.push_back(std::move(file)); }

  std::string take_bytes() { return std::move(bytes_); }
  std::vector<Descriptor> take_files() { return std::move(files_); }

 private:
  void write_size(std::uint64_t size) { write(size); }
  std::string bytes_;
  std::vector<Descriptor> files_;
};

/// Validates untrusted bytes: every read returns false if it is impossible.
class MessageReader {
 public:
  MessageReader(std::string_view bytes, std::vector<Descriptor> files) : bytes_(bytes), files_(std::move(files)) {}

  template <class T>
  [[nodiscard]] bool read(T& value) {
    if constexpr (std::is_arithmetic_v<T>) {
      if (bytes_.size() < sizeof value) return false;
      std::memcpy(&value, bytes_.data(), sizeof value);
      bytes_.remove_prefix(sizeof value);
      return true;
    } else {
      return std::apply([&](auto&... field) { return (read(field) && ...); }, fields(value));
    }
  }
  [[nodiscard]] bool read(bool& value) {
    std::uint8_t byte = 0;
    if (!read(byte) || byte > 1) return false;
    value = byte == 1;
    return true;
  }
  [[nodiscard]] bool read(std::string& text) {
    std::uint64_t size = 0;
    if (!read(size) || size > bytes_.size()) return false;
    text = bytes_.substr(0, size);
    bytes_.remove_prefix(size);
    return true;
  }
  template <class T>
  [[nodiscard]] bool read(std::vector<T>& list) {
    std::uint64_t size = 0;
    if (!read(size) || size > bytes_.size()) return false;  // an element takes at least one byte
    for (std::uint64_t i = 0; i < size; ++i) {
      if (!read(list.emplace_back())) return false;
    }
    return true;
  }
  [[nodiscard]] bool read(Descriptor& file) {
    if (next_file_ == files_.size()) return false;
    file = std::move(files_[next_file_++]);
    return true;
  }
  [[nodiscard]] bool at_end() const { return bytes_.empty() && next_file_ == files_.size(); }

 private:
  std::string_view bytes_;
  std::vector<Descriptor> files_;
  std::size_t next_file_ = 0;
};

}  // namespace worker
