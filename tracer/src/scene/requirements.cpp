#include "tracer/requirements.h"

#include <utility>

#include "tracer/src/scene/placement.h"

namespace tracer {
namespace {

bool has_normals(const Shape& shape) {
  if (const auto* mesh = std::get_if<Mesh>(&shape)) return mesh->smooth || !mesh->normals.empty();
  if (const auto* triangle = std::get_if<Triangle>(&shape)) return triangle->normals.has_value();
  return false;
}

bool is_quadric(const Shape& shape) {
  return std::holds_alternative<Disc>(shape) || std::holds_alternative<Cylinder>(shape) ||
         std::holds_alternative<Cone>(shape) || std::holds_alternative<Box>(shape);
}

bool is_soft(const LightSource& source) {
  return !std::holds_alternative<PointLight>(source) && !std::holds_alternative<DirectionalLight>(source) &&
         !std::holds_alternative<SpotLight>(source);
}

void require_background(Requirements& needs, const Scene& scene) {
  const auto require = [&](TextureId texture) {
    needs.environment = true;
    needs.filtered_textures |= scene.textures[texture.index].filter == Texture::Filter::mipmap;
  };
  if (scene.background.environment) require(scene.background.environment->texture);
  if (!scene.background.cube) return;
  for (const TextureId face : scene.background.cube->faces) require(face);
}

void require_textures(Requirements& needs, const Scene& scene, const Material& material) {
  const auto require = [&](TextureId texture) {
    needs.textures = true;
    needs.filtered_textures |= scene.textures[texture.index].filter == Texture::Filter::mipmap;
  };
  if (const auto* texture = std::get_if<TextureId>(&material.color)) require(*texture);
  if (material.bump) require(material.bump->texture);
  if (material.normal_map) require(*material.normal_map);
  needs.bump |= material.bump || material.normal_map;
}

}  // namespace

Requirements requirements(const Scene& scene) {
  Requirements needs;
  bool casting_light = false;
  bool solid_seen = false;
  needs.lens = scene.camera.aperture > 0 && scene.accuracy.samples > 1;
  needs.depth_cue = scene.depth_cue.has_value();
  needs.layers = scene.output.alpha || !scene.output.layers.empty();
  require_background(needs, scene);
  for (const Light& light : scene.lights) {
    casting_light |= light.shadows;
    needs.soft_lights |= is_soft(light.source);
  }
  for_each_placed(scene, [&](const Placed& object) {
    const Material& material = scene.materials[object.material.index];
    const bool transmits = material.transmission > 0;
    const bool refracts = transmits && material.transparency == Material::Transparency::refract;
    needs.refraction |= transmits;
    // Without Fresnel, total internal reflection still turns transmitted weight into reflected weight.
    needs.reflection |= material.reflection > 0 || refracts;
    needs.fresnel |= material.fresnel && (transmits || material.reflection > 0);
    needs.absorption |= transmits && !(material.absorption == Color{});
    needs.overlapping_media |= transmits && std::exchange(solid_seen, true);
    needs.gouraud |= material.shading == Material::Shading::gouraud;
    require_textures(needs, scene, material);
    needs.smooth_normals |= has_normals(object.shape);
    needs.spheres |= std::holds_alternative<Sphere>(object.shape);
    needs.planes |= std::holds_alternative<Plane>(object.shape);
    needs.triangles |= std::holds_alternative<Triangle>(object.shape) || std::holds_alternative<Mesh>(object.shape);
    needs.quadrics |= is_quadric(object.shape);
    needs.shadows |= casting_light && (material.diffuse > 0 || material.specular > 0);
  });
  needs.transmissive_shadows = needs.shadows && needs.refraction;
  return needs;
}

}  // namespace tracer
