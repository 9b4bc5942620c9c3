// The sentence about light between the surfaces of a scene.
#include <algorithm>
#include <array>
#include <cstdio>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "tracer/requirements.h"
#include "tracer/src/materials/energy_balance.h"
#include "tracer/src/scene/color_bound.h"
#include "tracer/src/scene/enclosure.h"
#include "tracer/src/scene/instancing.h"

namespace tracer {
namespace {

/// Light that the surfaces in use emit and give back.
struct SurfaceLight {
  /// Diffuse colors; the second number is a texture's index plus one, or 0.
  std::set<std::pair<std::array<double, 3>, std::uint32_t>> colors;
  double diffuse = 0;                       ///< largest share that one of them reflects or transmits diffusely
  double returned = 0;                      ///< largest share that one of them gives back in any way
  std::optional<std::string> emitter;       /// pointer of the first material that glows
  std::optional<std::string> excess;        ///< a material that gives back more than it receives
  std::optional<std::string> white_excess;  ///< one that does so with a white image file
};

void add(const Scene& scene, const Material& material, SurfaceLight& found) {
  const auto bound_of = [&](const ColorOrTexture& color) { return bound_before_reading(scene, color, 1); };
  const auto certain_bound_of = [&](const ColorOrTexture& color) { return bound_before_reading(scene, color, 0); };
  if (!found.emitter && max_component(bound_of(material.emission)) > 0) found.emitter = material.path;
  if (const auto excess = excess_of_light(material, certain_bound_of); excess && !found.excess)
    found.excess = material.path + " " + *excess;
  if (excess_of_light(material, bound_of) && !found.white_excess) found.white_excess = material.path;
  const Coefficients most = coefficients(material, {}, bound_of);
  const Color diffuse = most.diffuse + most.diffuse_transmission;
  if (!(max_component(diffuse) > 0)) return;
  const auto* texture = std::get_if<TextureId>(&material.color);
  found.colors.insert({{diffuse.r, diffuse.g, diffuse.b}, texture == nullptr ? 0 : texture->index + 1});
  found.diffuse = std::max(found.diffuse, max_component(diffuse));
  found.returned = std::max(found.returned, max_component(returned_share(material, bound_of)));
}

std::string text(double number) {
  std::array<char, 32> buffer{};
  std::snprintf(buffer.data(), buffer.size(), "%.2g", number);
  return buffer.data();
}

}  // namespace

std::string global_light_summary(const Scene& scene) {
  SurfaceLight found;
  for_each_placed(scene, [&](const Placed& placed) { add(scene, scene.materials[placed.material.index], found); });
  if (found.excess) return "not possible: " + *found.excess;
  if (found.colors.empty()) return "adds nothing: no surface reflects light diffusely";
  std::string sentence = "adds light between surfaces of " + std::to_string(found.colors.size()) + " diffuse color" +
                         (found.colors.size() == 1 ? "" : "s") + " that reflect up to " + text(found.diffuse);
  const Enclosure enclosure = enclosure_of_camera(scene);
  if (enclosure != Enclosure::none)
    sentence += enclosure == Enclosure::closed ? " in a closed room" : " in a room with an open side";
  sentence += ", ";
  // A mirror or glass without a diffuse part passes on light of other surfaces, which is counted there.
  sentence += found.returned < 1
                  ? "at most " + text(found.diffuse / (1 - found.returned)) + " times the brightest light without it"
                  : "without an upper bound";
  if (found.emitter) sentence += "; glowing surfaces light others (" + *found.emitter + ")";
  const Background& background = scene.background;
  if (max_component(background.color) > 0 || background.gradient || background.environment || background.cube)
    sentence += "; the background lights surfaces";
  if (found.white_excess)
    sentence += "; not possible if an image file is white: " + *found.white_excess +
                " then gives back more light than it receives";
  return sentence;
}

}  // namespace tracer
