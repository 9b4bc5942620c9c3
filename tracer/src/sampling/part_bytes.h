#pragma once
/// Bytes of parts and their results (tracer/parts.h): numbers in order, without padding.

#include <cmath>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

#include "tracer/render.h"
#include "tracer/src/integrators/tracer.h"
#include "tracer/src/math/vec.h"

namespace tracer {

class PartWriter {
 public:
  template <class Number>
  requires std::is_arithmetic_v<Number>
  void put(Number value) { bytes_.append(reinterpret_cast<const char*>(&value), sizeof value); }
  void put(const Color& color) { put_each(color.r, color.g, color.b); }
  void put(const Vec3& vector) { put_each(vector.x, vector.y, vector.z); }
  template <class... Values>
  void put_each(const Values&... values) {
    (put(values), ...);
  }
  void append(std::string_view bytes) { bytes_ += bytes; }

  [[nodiscard]] std::string take() { return std::move(bytes_); }

 private:
  std::string bytes_;
};

/// Source of bytes: this process, where sums may have overflowed, or another one.
enum class PartSource { own, untrusted };

/// Reads numbers. Every function returns false at the end of the bytes, and for an untrusted number that is not finite.
class PartReader {
 public:
  PartReader(std::string_view bytes, PartSource source) : bytes_(bytes), source_(source) {}

  template <class Number>
  requires std::is_arithmetic_v<Number>
  [[nodiscard]] bool get(Number& value) {
    if (!get_any(value)) return false;
    if constexpr (std::is_floating_point_v<Number>) return source_ == PartSource::own || std::isfinite(value);
    return true;
  }
  /// Accepts infinity as well.
  [[nodiscard]] bool get_any(auto& value) {
    if (bytes_.size() < sizeof value) return false;
    std::memcpy(&value, bytes_.data(), sizeof value);
    bytes_.remove_prefix(sizeof value);
    return true;
  }
  [[nodiscard]] bool get(Color& color) { return get_each(color.r, color.g, color.b); }
  [[nodiscard]] bool get(Vec3& vector) { return get_each(vector.x, vector.y, vector.z); }
  template <class... Values>
  [[nodiscard]] bool get_each(Values&... values) {
    return (get(values) && ...);
  }
  /// The next `size` bytes.
  [[nodiscard]] bool get_bytes(std::size_t size, std::string_view& bytes) {
    if (bytes_.size() < size) return false;
    bytes = bytes_.substr(0, size);
    bytes_.remove_prefix(size);
    return true;
  }
  [[nodiscard]] bool at_end() const { return bytes_.empty(); }

 private:
  std::string_view bytes_;
  PartSource source_;
};

/// Calls use(counter) for each counter that add() sums.
template <class Statistics, class Use>
void each_counter(Statistics& statistics, const Use& use) {
  use(statistics.rays.camera);
  use(statistics.rays.shadow);
  use(statistics.rays.reflection);
  use(statistics.rays.refraction);
  use(statistics.rays.diffuse);
  use(statistics.samples);
  use(statistics.holdout_samples);
  use(statistics.non_finite);
  use(statistics.culled_shadow_rays);
  use(statistics.culled_radiance);
  use(statistics.cut_branches);
  use(statistics.truncated_branches);
}

/// Counts of the batches between two states of a tracer.
inline RenderStatistics difference(RenderStatistics after, RenderStatistics before) {
  std::uint64_t* counters[12];
  std::size_t count = 0;
  each_counter(before, [&](std::uint64_t& counter) { counters[count++] = &counter; });
  count = 0;
  each_counter(after, [&](std::uint64_t& counter) { counter -= *counters[count++]; });
  return after;
}

}  // namespace tracer
