#include "tests/statistics/scene_corpus.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>

namespace statistics {

using namespace tracer;

const std::vector<Case>& corpus() {
  static const std::vector<Case> all = [] {
    std::vector<Case> cases;
    for (const auto& some :
         {shape_cases(), light_cases(), material_cases(), texture_cases(), view_cases(), subpixel_cases()})
      cases.insert(cases.end(), some.begin(), some.end());
    return cases;
  }();
  return all;
}

const Case* find(std::string_view name) {
  const auto found = std::find_if(corpus().begin(), corpus().end(), [&](const Case& c) { return c.name == name; });
  return found == corpus().end() ? nullptr : &*found;
}

Case empty_case(std::string name, std::string exercises) {
  Case made{std::move(name), std::move(exercises), {}};
  made.scene.image = {48, 36};
  made.scene.camera = {{0, 1.5, 6}, {0, 0.5, 0}, {0, 1, 0}, 40};
  made.scene.background.color = {0.1, 0.15, 0.25};
  made.scene.ambient = {0.1, 0.1, 0.1};
  return made;
}

Case lit_floor_case(std::string name, std::string exercises) {
  Case made = empty_case(std::move(name), std::move(exercises));
  scenes::add(made.scene, Plane{}, scenes::matte({0.8, 0.8, 0.8}));
  made.scene.lights.push_back(scenes::point_light({-4, 6, 5}, {0.9, 0.9, 0.9}));
  return made;
}

Light light_of(const LightSource& source, double intensity) {
  Light light;
  light.source = source;
  light.intensity = intensity;
  return light;
}

Material phong(const Color& color, double specular, double shininess) {
  Material material;
  material.color = color;
  material.specular = specular;
  material.shininess = shininess;
  return material;
}

Material textured(Scene& scene, const Texture& texture) {
  scene.textures.push_back(texture);
  Material material = scenes::matte({});
  material.color = TextureId{static_cast<std::uint32_t>(scene.textures.size() - 1)};
  return material;
}

Texture checker(double scale) {
  Texture texture;
  texture.pattern = CheckerTexture{{Color{0.05, 0.05, 0.05}, Color{0.9, 0.9, 0.9}}};
  texture.scale = {scale, scale};
  return texture;
}

Transform turned(double degrees, const Vec3& to, double scale) {
  const double a = degrees * std::numbers::pi / 180, c = scale * std::cos(a), s = scale * std::sin(a);
  Transform transform;
  transform.rows = {{{c, 0, s, to.x}, {0, scale, 0, to.y}, {-s, 0, c, to.z}}};
  return transform;
}

}  // namespace statistics
