#include "tracer/src/integrators/radiance_bound.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "tracer/src/textures/texture.h"

namespace tracer {
namespace {

constexpr double unbounded = std::numeric_limits<double>::infinity();

/// Upper bound of the light that a surface point receives from all lights.
double light_bound(const CompiledScene& scene) {
  double sum = 0;
  for (const CompiledLight& light : scene.lights)
    sum += max_component(light.radiance) * attenuation_bound(light.attenuation);
  return sum;
}

double color_bound(const CompiledScene& scene, const ColorOrTexture& color) {
  if (const auto* id = std::get_if<TextureId>(&color))
    return texture_bound(scene.textures[id->index], scene.images[id->index].get());
  return max_component(std::get<Color>(color));
}

/// Upper bound of the fraction of light that secondary rays receive.
double albedo_bound(const CompiledScene& scene, const Material& material) {
  if (is_principled(material)) return 1;
  const bool diffuse = scene.needs.global_light;
  const double scattered =
      diffuse ? material.diffuse * color_bound(scene, material.color) +
                    material.diffuse_transmission * color_bound(scene, material.diffuse_transmission_color)
              : 0;
  const double reflected = material.reflection * color_bound(scene, material.reflection_color);
  const double transmitted = material.transmission * color_bound(scene, material.transmission_color);
  // Fresnel's reflectance and transmittance add up to one.
  return scattered + (material.fresnel ? std::max(reflected, transmitted) : reflected + transmitted);
}

double local_radiance_bound(const CompiledScene& scene, const Material& material, double lights) {
  const double color = color_bound(scene, material.color);
  const double diffuse = color * material.diffuse;
  const double specular = color_bound(scene, material.specular_color);
  // A light is on one side of the surface.
  const double facets = is_principled(material) ? PrincipledSurface::highlight_max + 1 : specular * material.specular;
  const double reflected = diffuse + facets;
  const double transmitted = color_bound(scene, material.diffuse_transmission_color) * material.diffuse_transmission +
                             specular * material.specular_transmission;
  const double lit = std::max(reflected, transmitted);
  return color_bound(scene, material.emission) + max_component(scene.ambient) * color * material.ambient +
         (lit > 0 && lights > 0 ? lights * lit : 0);
}

}  // namespace

std::optional<double> radiance_bound(const CompiledScene& scene) {
  const double lights = light_bound(scene);
  double bound = scene.background->bound();
  for (const std::uint32_t index : std::set(scene.objects.material.begin(), scene.objects.material.end())) {
    const Material& material = scene.materials[index];
    const double local = local_radiance_bound(scene, material, lights), albedo = albedo_bound(scene, material);
    bound = std::max(bound, local > 0 && albedo < 1 ? local / (1 - albedo) : local > 0 || albedo > 1 ? unbounded : 0);
  }
  return std::isfinite(bound) ? std::optional(bound) : std::nullopt;
}

}  // namespace tracer
