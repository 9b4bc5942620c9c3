// Scenes of random solids, of any materials, and the random grammar.
#include <cmath>
#include <numbers>

#include "tests/statistics/error_coverage/corpus.h"
#include "tests/support/scenes.h"

namespace error_coverage {
namespace {

using namespace tracer;
using oracle::Random;
using scenes::matte;

/// Metal, plastic, glass or varnish of any roughness.
Material random_principled(Random& random) {
  Material material = matte(random.color());
  material.model = Material::Model::principled;
  material.specular = 1;
  const double roughness = random.chance(0.2) ? 0 : random.in(0, 1), kind = random.in(0, 1);
  material.roughness = Color{roughness, roughness, roughness};
  if (kind < 0.4) {
    material.metallic = Color{1, 1, 1};
  } else if (kind < 0.6) {
    material.transmission = material.reflection = 1;
    material.fresnel = true;
  } else if (kind < 0.8) {
    material.coat = Color{1, 1, 1};
  }
  return material;
}

Material random_material(Random& random) {
  const double kind = random.in(0, 1);
  if (kind < 0.15) return scenes::glass();
  if (kind > 0.85) return random_principled(random);
  Material material = matte(random.color());
  if (kind < 0.55) {
    material.model = Material::Model::phong;
    material.specular = random.in(0, 1);
    material.shininess = random.spread(4, 200);
  }
  if (kind < 0.35) material.reflection = random.in(0, 0.6);
  return material;
}

Shape random_solid(Random& random, const Vec3& at, double size) {
  switch (random.below(5)) {
    case 0:
      return Sphere{at, size};
    case 1:
      return Box{{at.x - size, at.y - size, at.z - size}, {at.x + size, at.y + size, at.z + size}};
    case 2:
      return Torus{at, {random.in(-1, 1), 1, random.in(-1, 1)}, size, size * random.in(0.05, 0.4), {}};
    case 3:
      return Cylinder{at, {at.x + random.in(-1, 1), at.y + size, at.z}, size * random.spread(0.02, 0.6), true, {}};
    default:
      return scenes::placed(scenes::icosphere(1, random.chance(0.5)), size, at);
  }
}

LightSource random_light(Random& random) {
  const Vec3 at{random.in(-5, 5), random.in(4, 7), random.in(0, 5)};
  switch (random.below(4)) {
    case 0:
      return PointLight{at};
    case 1:
      return SphereLight{at, random.in(0.1, 1)};
    case 2:
      return RectLight{at, {random.in(0.2, 2), 0, 0}, {0, 0, random.in(0.2, 2)}};
    default:
      return DirectionalLight{{-at.x, -at.y, -at.z}};
  }
}

/// Objects on a floor, in perspective.
CorpusScene random_solids(Canvas canvas, Random& random) {
  CorpusScene result;
  Scene& scene = result.scene;
  scene.image = {canvas.width, canvas.height};
  scene.camera = {{random.in(-3, 3), random.in(1, 4), 7}, {0, 0.7, 0}, {0, 1, 0}, random.in(25, 50)};
  scene.background.color = random.color();
  scene.ambient = {0.1, 0.1, 0.1};
  const std::uint32_t lights = 1 + random.below(2), solids = 2 + random.below(10);
  for (std::uint32_t i = 0; i < lights; ++i)
    scene.lights.push_back({.source = random_light(random), .intensity = 0.8 / lights});
  Material floor = matte(random.color(0.3));
  if (random.chance(0.4)) {
    scene.textures = {{.pattern = CheckerTexture{{random.color(), random.color()}}, .path = {}}};
    floor.color = TextureId{0};
  }
  scenes::add(scene, Plane{}, floor);
  for (std::uint32_t i = 0; i < solids; ++i) {
    const double size = random.spread(0.03, 0.8);
    const Vec3 at{random.in(-3, 3), size + random.in(0, 0.5), random.in(-3, 3)};
    scenes::add(scene, random_solid(random, at, size), random_material(random));
  }
  return result;
}

/// Solids with the approximations that change few of their pixels or all of them slightly.
CorpusScene approximate_solids(Canvas canvas, Random& random) {
  CorpusScene result = random_solids(canvas, random);
  Approximations& approximate = result.scene.accuracy.approximate;
  if (random.chance(0.5)) approximate.shading = Approximations::Shading::flat;
  if (random.chance(0.5)) approximate.reflections = Approximations::Reflections::environment;
  approximate.nearest_lights = 1;
  return result;
}

/// Solids of principled materials.
CorpusScene rough_solids(Canvas canvas, Random& random, Accuracy::Model model) {
  CorpusScene result = random_solids(canvas, random);
  result.scene.accuracy.model = model;
  for (Material& material : result.scene.materials) {
    const ColorOrTexture color = material.color;
    material = random_principled(random);
    material.color = color;
  }
  return result;
}

Polygon random_polygon(Random& random, const Vec2& place, double size) {
  const double angle = random.in(0, std::numbers::pi);
  switch (random.below(3)) {
    case 0:
      return rectangle(place, size, size, angle);
    case 1:
      return rectangle(place, size, size * random.spread(0.01, 1), angle);
    default:
      return disc(place, size / 2, 3 + static_cast<int>(random.below(30)));
  }
}

/// Polygons before a ground, seen directly, in a mirror or through glass: with a closed form.
CorpusScene random_polygons(Canvas canvas, Random& random) {
  FlatScene result = random.chance(0.3)
                         ? FlatScene(canvas, random.color(), random.color())
                         : FlatScene(canvas, random.color(), static_cast<FlatScene::View>(random.below(3)));
  const double largest = random.spread(0.1, 0.3 * canvas.height), brightest = random.chance(0.15) ? 20 : 1;
  const int count = 1 + static_cast<int>(random.spread(1, 40));
  for (const Vec2& place : random_places(canvas, random, count, 1.5 * largest + 1)) {
    const Color color = random.color();
    const double factor = random.in(0.2, brightest);
    result.add(random_polygon(random, place, largest * random.spread(0.1, 1)),
               {factor * color.r, factor * color.g, factor * color.b});
  }
  Output& output = result.scene().output;
  if (random.chance(0.1)) output.overflow = Output::Overflow::scale;
  if (random.chance(0.1)) output.overflow = Output::Overflow::reinhard;
  if (random.chance(0.3)) output.exposure = random.in(-1, 2);
  return finished(result);
}

}  // namespace

GrammarScene grammar_scene(std::uint64_t seed, Canvas largest) {
  Random random(seed);
  const bool closed_form = random.chance(0.75);
  const auto side = [&](std::uint32_t limit) {
    return static_cast<std::uint32_t>(std::lround(random.spread(64, limit)));
  };
  Canvas canvas;
  canvas.width = side(largest.width);
  canvas.height = side(largest.height);
  return {canvas, closed_form ? random_polygons(canvas, random) : random_solids(canvas, random)};
}

std::vector<CorpusEntry> random_entries() {
  using enum SettingGroup;
  std::vector<CorpusEntry> entries{
      {"ordinary, sampled", "random solids", targets, random_solids, false},
      {"approximations", "solids, nearest light", targets, approximate_solids, false},
  };
  for (const auto& [light, model, targeted] :
       {std::tuple{"local", Accuracy::Model::whitted, targets}, {"global", Accuracy::Model::global, tiles}}) {
    const auto build = [model](Canvas canvas, Random& random) { return rough_solids(canvas, random, model); };
    const std::string name = std::string("solids in ") + light + " light";
    entries.push_back({"rough materials", name, targeted, build, false});
    entries.push_back({"rough materials, fixed samples", name, fixed_samples, build, false});
  }
  return entries;
}

}  // namespace error_coverage
