#pragma once
/// Value types of scenes: points, colors and handles. Frame and units are defined in scene.h.

#include <cstdint>

namespace tracer {

struct Vec2 {
  double x = 0, y = 0;
  bool operator==(const Vec2&) const = default;
};

struct Vec3 {
  double x = 0, y = 0, z = 0;
  bool operator==(const Vec3&) const = default;
};

/// Linear RGB. Components >= 0; no upper bound.
struct Color {
  double r = 0, g = 0, b = 0;
  bool operator==(const Color&) const = default;
};

/// Index into one of Scene's vectors; the tag makes handles of different vectors different types.
template <class Tag>
struct Handle {
  std::uint32_t index = 0;
  bool operator==(const Handle&) const = default;
};
using MaterialId = Handle<struct MaterialTag>;
using PrototypeId = Handle<struct PrototypeTag>;
using TextureId = Handle<struct TextureTag>;
using AssetId = Handle<struct AssetTag>;

}  // namespace tracer
