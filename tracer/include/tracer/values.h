#pragma once
/// What scenes are written in: points, colours and handles. Frame and units are scene.h's.

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

/// Position in one of Scene's vectors; the tag keeps a material from being used as a texture.
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
