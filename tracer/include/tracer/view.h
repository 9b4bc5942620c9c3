#pragma once
/// Layers of image files as PNG for display: part of the pixels, at a smaller size, as gray or in colors.

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tracer/limits.h"
#include "tracer/result.h"

namespace tracer {

/// The layers that can be viewed. All but `color` are channels of OpenEXR (tracer/encode.h).
enum class ViewedLayer { color, depth, normal, albedo, object_id, samples, error };
inline constexpr const char* viewed_layer_names[] = {"color",     "depth",   "normal", "albedo",
                                                     "object_id", "samples", "error"};
/// The layers whose pixels are one number that `range` and `heat` show.
constexpr bool is_number(ViewedLayer layer) {
  return layer == ViewedLayer::depth || layer == ViewedLayer::samples || layer == ViewedLayer::error;
}
constexpr bool is_light(ViewedLayer layer) { return layer == ViewedLayer::color || layer == ViewedLayer::albedo; }

struct View {
  ViewedLayer layer = ViewedLayer::color;
  double exposure = 0;  ///< stops, of color and albedo
  /// Values shown black and white, of numbers and of the components of normals. Unset: the least and the greatest
  /// finite one of the part; -1 and 1 for normals.
  std::optional<std::array<double, 2>> range{};
  bool heat = false;                                   ///< numbers in the colors of heat_map (compare.h), not in gray
  std::optional<std::array<std::uint32_t, 4>> crop{};  ///< x, y, width, height; within the image
  std::uint32_t side = 0;                              ///< pixels along the longer side of the result, at most; >= 1
};

struct ViewFailure {
  enum class Reason { not_readable, no_layer } reason = Reason::not_readable;
  std::string sentence;
};

/// The PNG, 8 bits and without alpha. Reduced pixels are means of the layer's values over the pixels that they cover,
/// without those that are not finite; where there are none, black. The color of an object is a hash of its id, of the
/// first pixel covered; black for none. `color` may come from any file that read_image (compare.h) reads, other layers
/// from OpenEXR.
Result<std::vector<std::uint8_t>, ViewFailure> view(std::span<const std::uint8_t> bytes, const View& settings,
                                                    const TextureImageLimits& limits);

}  // namespace tracer
