#pragma once
/// Sizes of reduced images, and the pixels of the source that one of theirs covers.

#include <algorithm>
#include <cstdint>
#include <utility>

namespace tracer {

/// Length of an edge of `pixels` in an image whose longer edge, of `longer` pixels, is reduced to at most `side`.
inline std::uint32_t reduced_length(std::uint32_t pixels, std::uint32_t longer, std::uint32_t side) {
  if (longer <= side) return pixels;
  return std::max<std::uint32_t>(1, static_cast<std::uint32_t>(std::uint64_t{pixels} * side / longer));
}

/// The pixels [begin, end) of the source that pixel `index` of `count` covers; at least one.
inline std::pair<std::uint32_t, std::uint32_t> covered_pixels(std::uint32_t index, std::uint32_t count,
                                                              std::uint32_t source) {
  const auto edge = [&](std::uint64_t i) { return static_cast<std::uint32_t>(i * source / count); };
  return {edge(index), std::max(edge(index + 1), edge(index) + 1)};
}

}  // namespace tracer
