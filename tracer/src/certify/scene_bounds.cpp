#include "tracer/src/certify/scene_bounds.h"

#include <algorithm>
#include <limits>

#include "tracer/src/certify/radiance_bound.h"

namespace tracer {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

ColorInterval background_range(const CompiledScene& scene) {
  if (const Color* const plain = scene.background->plain()) return interval_of(*plain);
  const double bound = scene.background->bound();
  return {{{0, bound}, {0, bound}, {0, bound}}};
}

}  // namespace

SceneBounds::SceneBounds(const CompiledScene& compiled, const Approximations& approximations,
                         const RenderControl& control)
    : scene(compiled),
      tree(compiled.geometry(), control),
      radiance_max(compiled.needs_of(approximations).global_light ? infinity
                                                                  : radiance_bound(compiled).value_or(infinity)),
      approximate(approximations),
      outside_absorbs(!(compiled.media.outside.absorption == Color{})),
      in_medium(outside_absorbs || !compiled.media.enclosing_camera.empty()),
      overlapping_media(compiled.needs.overlapping_media || compiled.exact.needs.overlapping_media) {
  for (std::size_t i = 0; i < scene.textures.size(); ++i)
    textures.push_back(texture_range(scene.textures[i], scene.images[i].get()));
  background = background_range(scene);
  for (const Material& material : scene.materials) {
    const Coefficients largest =
        coefficients(material, scene.ambient_of(approximate), [&](const ColorOrTexture& color) {
          const ColorInterval range = color_range(textures, color);
          return Color{range[0].high, range[1].high, range[2].high};
        });
    // The missing part of a surface transmits everything.
    const double missing = is_cut_out(material) ? 1 : 0;
    const Color& through = largest.transmittance;
    secondary_max.push_back(
        {compiled.needs_of(approximate).global_light ? largest.scattered() + largest.reflectance : largest.reflectance,
         {std::max(through.r, missing), std::max(through.g, missing), std::max(through.b, missing)}});
    if (max_component(through) > 1) transmittance_max = infinity;
  }
}

}  // namespace tracer
