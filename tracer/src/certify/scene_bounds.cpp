#include "tracer/src/certify/scene_bounds.h"

#include <algorithm>
#include <limits>

#include "tracer/src/integrators/radiance_bound.h"

namespace tracer {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

std::array<double, 3> channels_of(const Color& c) { return {c.r, c.g, c.b}; }

/// Coefficients over the values of the textures, with which they grow or shrink; `bright`: of the brightest values.
Coefficients coefficients_at_end(const CompiledScene& scene, const Material& material, bool bright) {
  return coefficient_bounds(material, scene.ambient_of({}), [&](const ColorOrTexture& color) {
    const auto* const id = std::get_if<TextureId>(&color);
    if (id == nullptr) return std::get<Color>(color);
    const double bound = bright ? texture_bound(scene.textures[id->index], scene.images[id->index].get()) : 0;
    return Color{bound, bound, bound};
  });
}

SceneBounds::MaterialRange range_of(const SceneBounds& bounds, std::size_t index) {
  const CompiledScene& scene = bounds.scene;
  const CompiledMaterial& terms = scene.terms_of({})[index];
  const Coefficients low = coefficients_at_end(scene, scene.materials[index], false),
                     high = coefficients_at_end(scene, scene.materials[index], true);
  const auto range = [&](Color Coefficients::*factor) {
    ColorInterval all = hull(interval_of(low.*factor), interval_of(high.*factor));
    if (terms.textured)  // averages of texels are rounded
      for (Interval& channel : all) channel.high *= 1 + 0x1p-40;
    return all;
  };
  SceneBounds::MaterialRange material{.emitted_ambient = range(&Coefficients::emitted_ambient),
                                      .diffuse = range(&Coefficients::diffuse),
                                      .specular = range(&Coefficients::specular)};
  material.has_normal = !terms.has_normal_map && !is_lit_by_triangle(terms.shading) && !terms.principled;
  const bool overlaps = scene.needs.overlapping_media || scene.exact.needs.overlapping_media;
  material.may_be_hidden = terms.transmits && overlaps;
  const std::array<double, 3> reflected = channels_of(high.reflectance), through = channels_of(high.transmittance);
  for (std::size_t c = 0; c < 3; ++c) {
    double lights = 0;
    for (const CompiledLight& light : scene.lights)
      lights += channels_of(light.radiance)[c] > 0
                    ? channels_of(light.radiance)[c] * attenuation_bound(light.attenuation) *
                          (light.shadows ? bounds.transmittance_max : 1)
                    : 0;
    const double facets = terms.principled ? PrincipledSurface::highlight_max + 1 : material.specular[c].high;
    const double near = material.diffuse[c].high + facets;
    const double far = channels_of(high.diffuse_transmission)[c] + channels_of(high.specular_transmission)[c];
    const auto lit = [&](double factor) { return factor > 0 && lights > 0 ? factor * lights : 0; };
    // The missing part of a surface transmits everything. Fresnel's reflectance and transmittance add up to one.
    const double transmitted = is_cut_out(scene.materials[index]) ? std::max(1.0, through[c]) : through[c];
    const double secondary = terms.principled ? 1
                             : terms.fresnel  ? std::max(reflected[c], transmitted)
                                              : reflected[c] + transmitted;
    const double arriving = secondary > 0 && bounds.radiance_max > 0 ? secondary * bounds.radiance_max : 0;
    const bool scatters =
        terms.principled || material.diffuse[c].high > 0 || channels_of(high.diffuse_transmission)[c] > 0;
    const double paths = scene.needs_of({}).global_light && scatters ? infinity : 0;
    material.other_max[c] = lit(far) + arriving + paths;
    material.anywhere[c] = sum(material.emitted_ambient[c], {0, lit(near) + material.other_max[c]});
  }
  if (material.may_be_hidden) material.anywhere = hull(material.anywhere, bounds.any_radiance());
  return material;
}

}  // namespace

SceneBounds::SceneBounds(const CompiledScene& compiled, const RenderControl& control)
    : scene(compiled),
      tree(compiled.geometry(), control),
      radiance_max(compiled.needs_of({}).global_light ? infinity : radiance_bound(compiled).value_or(infinity)),
      outside_absorbs(!(compiled.media.outside.absorption == Color{})),
      in_medium(outside_absorbs || !compiled.media.enclosing_camera.empty()),
      culls(compiled.needs.many_lights || compiled.exact.needs.many_lights) {
  for (const Material& material : scene.materials)
    if (max_component(coefficients_at_end(scene, material, true).transmittance) > 1) transmittance_max = infinity;
  for (std::size_t i = 0; i < scene.materials.size(); ++i) materials.push_back(range_of(*this, i));
  const double bound = scene.background->bound();
  const Color* const plain = scene.background->plain();
  background = plain != nullptr ? interval_of(*plain) : ColorInterval{{{0, bound}, {0, bound}, {0, bound}}};
}

}  // namespace tracer
