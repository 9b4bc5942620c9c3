#pragma once
/// The first sample of every pixel, or of as many as there is time for.

#include <cstdint>
#include <span>
#include <utility>

namespace tracer {

/// The pilot's passes: every so many pixels in each direction, from one in a tile on. Against a deadline from coarse to
/// fine, so that whenever it comes there is a picture; else all at once.
inline std::span<const std::uint32_t> pilot_strides(bool deadline) {
  static constexpr std::uint32_t strides[] = {32, 16, 8, 4, 2, 1};
  return deadline ? std::span(strides) : std::span(strides).last(1);
}

/// A place in an order of `count` things that has nothing to do with the usual one; each once.
inline std::uint64_t scattered(std::uint64_t index, std::uint64_t count) {
  // Steps of the golden ratio's size, made coprime to `count`, visit everything once.
  auto step = static_cast<std::uint64_t>(static_cast<double>(count) * 0.6180339887498949) | 1;
  const auto common = [](std::uint64_t a, std::uint64_t b) {
    while (b != 0) a = std::exchange(b, a % b);
    return a;
  };
  while (common(step, count) != 1) step += 2;
  return (index * step) % count;
}

}  // namespace tracer
