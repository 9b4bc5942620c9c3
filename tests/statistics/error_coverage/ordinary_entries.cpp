// Ordinary scenes: edges, gradients, checkers, penumbrae and glossy solids, with closed forms where they exist.
#include <cmath>
#include <numbers>

#include "tests/statistics/error_coverage/corpus.h"
#include "tests/support/scenes.h"
#include "tracer/encode.h"

namespace error_coverage {
namespace {

using namespace tracer;
using oracle::Random;

CorpusScene half_plane(Canvas canvas, Random& random) {
  FlatScene flat(canvas, {0.1, 0.15, 0.3});
  const double angle = random.in(0, 2 * std::numbers::pi), reach = canvas.width + canvas.height;
  const Vec2 place = random_place(canvas, random, 0.3 * canvas.height);
  flat.add(
      rectangle({place.x - reach * std::sin(angle), place.y + reach * std::cos(angle)}, 2 * reach, 2 * reach, angle),
      {0.8, 0.7, 0.5});
  return finished(flat);
}

CorpusScene shapes_on_gradient(Canvas canvas, Random& random) {
  FlatScene flat(canvas, {0.1, 0.1, 0.2}, {0.5, 0.6, 0.7});
  for (const Vec2& place : random_places(canvas, random, 12, 28)) {
    if (random.chance(0.5)) {
      flat.add(disc(place, random.in(5, 13)), random.color());
    } else {
      flat.add(rectangle(place, random.in(6, 18), random.in(6, 18), random.in(0, std::numbers::pi)), random.color());
    }
  }
  return finished(flat);
}

CorpusScene checker_of(Canvas canvas, Random& random, double cell) {
  const Vec2 offset{random.in(0, 2), random.in(0, 2)};
  const Color even{0.1, 0.1, 0.1}, odd{0.8, 0.75, 0.6};
  CorpusScene result;
  result.scene = orthographic_scene(canvas);
  Texture texture;
  texture.pattern = CheckerTexture{{even, odd}};
  texture.scale = {1 / cell, 1 / cell};
  texture.offset = offset;
  texture.filter = random.chance(0.5) ? Texture::Filter::mipmap : Texture::Filter::nearest;
  result.scene.textures.push_back(texture);
  result.scene.ambient = {1, 1, 1};
  Material material = scenes::matte({});
  material.color = TextureId{0};
  scenes::add(result.scene, Plane{{0, 0, 0}, {0, 0, 1}, Vec3{1, 0, 0}}, material);
  result.exact = checker_image(canvas, cell, offset, even, odd);
  return result;
}

CorpusScene checker(Canvas canvas, Random& random) { return checker_of(canvas, random, random.in(4, 12)); }

/// The dark squares are holes before a background of their color: filters average the color and the holes apart.
CorpusScene checker_of_holes(Canvas canvas, Random& random) {
  CorpusScene result = checker_of(canvas, random, random.in(1, 4));
  Scene& scene = result.scene;
  const Texture squares = scene.textures[0];
  scene.background.color = std::get<CheckerTexture>(squares.pattern).colors[0];
  scene.textures[0].filter = Texture::Filter::mipmap;
  scene.textures.push_back(scene.textures[0]);
  scene.textures[1].pattern = CheckerTexture{{Color{0, 0, 0}, Color{1, 1, 1}}};
  scene.materials.back().opacity = TextureId{1};
  return result;
}

/// A plane with bumps that are finer than pixels: filters average normals.
CorpusScene bumps(Canvas canvas, Random& random) {
  CorpusScene result;
  Scene& scene = result.scene;
  scene.image = {canvas.width, canvas.height};
  scene.camera = {{0, 3, 7}, {0, 0.5, 0}, {0, 1, 0}, 40};
  scene.ambient = {0.1, 0.1, 0.1};
  Light sun;
  sun.source = DirectionalLight{{random.in(-1, 1), -1, -1}};
  scene.lights.push_back(sun);
  Texture noise;
  noise.pattern = NoiseTexture{{Color{0, 0, 0}, Color{1, 1, 1}}, 6};
  noise.scale = {random.in(1, 3), random.in(1, 3)};
  scene.textures.push_back(noise);
  Material ground = scenes::matte({0.8, 0.8, 0.8});
  ground.bump = Bump{TextureId{0}, random.in(0.05, 0.3)};
  scenes::add(scene, Plane{}, ground);
  return result;
}

/// An image of a dark square on a floor: far pixels are long and narrow on it, and its filter is as wide as they are
/// long.
CorpusScene tiled_floor(Canvas canvas, Random& random) {
  constexpr std::uint32_t side = 64;
  Image tile{side, side, std::vector<float>(3 * side * side, 0.8F)};
  for (std::uint32_t row = side / 8; row < side / 2; ++row)
    std::fill_n(tile.rgb.begin() + 3 * (row * side + side / 8), 3 * side / 2, 0.05F);
  CorpusScene result;
  Scene& scene = result.scene;
  result.assets.bytes = {encode(tile, Format::exr)->bytes};
  scene.assets = {{"tile.exr", "/textures/tile/file"}};
  scene.image = {canvas.width, canvas.height};
  scene.camera = {{0, random.in(0.5, 1.5), 4}, {0, 0.4, 0}, {0, 1, 0}, 50};
  scene.background.color = {0.2, 0.3, 0.5};
  scene.ambient = {1, 1, 1};
  Texture texture;
  texture.pattern = ImageTexture{AssetId{0}, ColorSpace::linear};
  texture.scale = {random.spread(0.3, 3), random.spread(0.3, 3)};
  scene.textures.push_back(texture);
  Material floor = scenes::matte({});
  floor.color = TextureId{0};
  scenes::add(scene, Plane{}, floor);
  return result;
}

/// A sphere light behind a row of posts.
CorpusScene penumbra(Canvas canvas, Random& random) {
  CorpusScene result;
  Scene& scene = result.scene;
  scene.image = {canvas.width, canvas.height};
  scene.camera = {{0, 3, 7}, {0, 0.5, 0}, {0, 1, 0}, 40};
  scene.background.color = {0.1, 0.15, 0.25};
  scene.ambient = {0.1, 0.1, 0.1};
  Light lamp;
  lamp.source = SphereLight{{random.in(-3, 0), 4, -2}, 0.7};
  scene.lights.push_back(lamp);
  scenes::add(scene, Plane{}, scenes::matte({0.8, 0.8, 0.8}));
  for (double x = -2; x <= 2; x += 1)
    scenes::add(scene, Cylinder{{x, 0, random.in(-1, 1)}, {x, 1.5, 0}, 0.1, true, {}}, scenes::matte({0.9, 0.5, 0.3}));
  return result;
}

/// A disc of paper before the light, which comes through it.
CorpusScene lit_paper(Canvas canvas, Random& random) {
  CorpusScene result = penumbra(canvas, random);
  Material paper = scenes::matte({0.5, 0.45, 0.4});
  paper.diffuse_transmission = random.in(0.2, 0.5);
  scenes::add(result.scene, Disc{{random.in(-1, 1), 1.5, 1.5}, {0, 0, 1}, 0.8, 0, {}}, paper);
  return result;
}

Material random_material(Random& random) {
  const double kind = random.in(0, 1);
  if (kind < 0.15) return scenes::glass();
  Material material = scenes::matte(random.color());
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

}  // namespace

CorpusScene random_solids(Canvas canvas, Random& random) {
  CorpusScene result;
  Scene& scene = result.scene;
  scene.image = {canvas.width, canvas.height};
  scene.camera = {{random.in(-3, 3), random.in(1, 4), 7}, {0, 0.7, 0}, {0, 1, 0}, random.in(25, 50)};
  scene.background.color = random.color();
  scene.ambient = {0.1, 0.1, 0.1};
  const std::uint32_t lights = 1 + random.below(2), solids = 2 + random.below(10);
  for (std::uint32_t i = 0; i < lights; ++i) {
    Light light;
    light.source = random_light(random);
    light.intensity = 0.8 / lights;
    scene.lights.push_back(light);
  }
  Material floor = scenes::matte(random.color(0.3));
  if (random.chance(0.4)) {
    Texture texture;
    texture.pattern = CheckerTexture{{random.color(), random.color()}};
    scene.textures.push_back(texture);
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

std::vector<CorpusEntry> ordinary_entries() {
  using enum SettingGroup;
  return {
      {"fixed samples", "half plane", fixed_samples, half_plane},
      {"fixed samples", "shapes on a gradient", fixed_samples, shapes_on_gradient},
      {"fixed samples", "checker", fixed_samples, checker},
      {"fixed samples", "checker of holes", fixed_samples, checker_of_holes},
      {"fixed samples", "bumps", fixed_samples, bumps, false},
      {"fixed samples", "floor of tiles", fixed_samples, tiled_floor, false},
      {"fixed samples", "penumbra", fixed_samples, penumbra, false},
      {"ordinary, closed form", "half plane", budgets, half_plane},
      {"ordinary, closed form", "shapes on a gradient", budgets, shapes_on_gradient},
      {"ordinary, closed form", "checker", targets, checker},
      {"ordinary, sampled", "penumbra", budgets, penumbra, false},
      {"ordinary, sampled", "lit paper", targets, lit_paper, false},
      {"ordinary, sampled", "random solids", targets, random_solids, false},
  };
}

std::vector<CorpusEntry> corpus(const std::string& source_directory) {
  std::vector<CorpusEntry> all;
  for (const auto& entries : {display_entries(), feature_entries(), ordinary_entries(), difficult_entries(),
                              global_entries(), example_entries(source_directory)})
    all.insert(all.end(), entries.begin(), entries.end());
  return all;
}

CorpusScene finished(FlatScene& flat) { return {.scene = flat.scene(), .exact = flat.exact_image()}; }

Vec2 random_place(Canvas canvas, Random& random, double margin) {
  const double x = canvas.width / 2.0 - margin, y = canvas.height / 2.0 - margin;
  return {random.in(-x, x), random.in(-y, y)};
}

std::vector<Vec2> random_places(Canvas canvas, Random& random, int count, double distance) {
  std::vector<Vec2> places;
  for (int attempt = 0; attempt < 200 * count && static_cast<int>(places.size()) < count; ++attempt) {
    const Vec2 place = random_place(canvas, random);
    bool apart = true;
    for (const Vec2& other : places) apart &= std::hypot(place.x - other.x, place.y - other.y) >= distance;
    if (apart) places.push_back(place);
  }
  return places;
}

}  // namespace error_coverage
