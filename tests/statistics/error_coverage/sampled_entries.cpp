// Scenes without a closed form: ordinary ones, difficult ones (visibility that changes often, detail finer than pixels,
// filters), and the example scenes of the repository.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <numbers>
#include <stdexcept>

#include "api/render_document.h"
#include "tests/statistics/error_coverage/corpus.h"
#include "tests/support/scenes.h"
#include "tracer/encode.h"

namespace error_coverage {
namespace {

using namespace tracer;
using oracle::Random;
using scenes::matte;

/// A camera above a floor of this material, blue background.
CorpusScene floor_of(Canvas canvas, const Material& material) {
  CorpusScene result;
  Scene& scene = result.scene;
  scene.image = {canvas.width, canvas.height};
  scene.camera = {{0, 3, 7}, {0, 0.5, 0}, {0, 1, 0}, 40};
  scene.background.color = {0.1, 0.15, 0.25};
  scene.ambient = {0.1, 0.1, 0.1};
  scenes::add(scene, Plane{}, material);
  return result;
}

void add_light(Scene& scene, const LightSource& source) { scene.lights.push_back({.source = source}); }

/// Bumps that are finer than pixels: filters average normals.
CorpusScene bumps(Canvas canvas, Random& random) {
  const NoiseTexture noise{{Color{0, 0, 0}, Color{1, 1, 1}}, 6};
  const Texture texture{.pattern = noise, .scale = {random.in(1, 3), random.in(1, 3)}, .path = {}};
  Material ground = matte({0.8, 0.8, 0.8});
  ground.bump = Bump{TextureId{0}, random.in(0.05, 0.3)};
  CorpusScene result = floor_of(canvas, ground);
  result.scene.textures.push_back(texture);
  add_light(result.scene, DirectionalLight{{random.in(-1, 1), -1, -1}});
  return result;
}

/// An image of a dark square on a floor: far pixels are long and narrow on it, and its filter is as wide as they are
/// long.
CorpusScene tiled_floor(Canvas canvas, Random& random) {
  constexpr std::uint32_t side = 64;
  Image tile{side, side, std::vector<float>(3 * side * side, 0.8F)};
  for (std::uint32_t row = side / 8; row < side / 2; ++row)
    std::fill_n(tile.rgb.begin() + 3 * (row * side + side / 8), 3 * side / 2, 0.05F);
  const ImageTexture image{AssetId{0}, ColorSpace::linear};
  const Texture texture{.pattern = image, .scale = {random.spread(0.3, 3), random.spread(0.3, 3)}, .path = {}};
  Material material = matte({});
  material.color = TextureId{0};
  CorpusScene result = floor_of(canvas, material);
  Scene& scene = result.scene;
  scene.camera = {{0, random.in(0.5, 1.5), 4}, {0, 0.4, 0}, {0, 1, 0}, 50};
  scene.ambient = {1, 1, 1};
  scene.textures.push_back(texture);
  scene.assets = {{"tile.exr", "/textures/tile/file"}};
  result.assets.bytes = {encode(tile, Format::exr)->bytes};
  return result;
}

/// A sphere light behind a row of posts.
CorpusScene penumbra(Canvas canvas, Random& random) {
  CorpusScene result = floor_of(canvas, matte({0.8, 0.8, 0.8}));
  add_light(result.scene, SphereLight{{random.in(-3, 0), 4, -2}, 0.7});
  for (double x = -2; x <= 2; x += 1)
    scenes::add(result.scene, Cylinder{{x, 0, random.in(-1, 1)}, {x, 1.5, 0}, 0.1, true, {}}, matte({0.9, 0.5, 0.3}));
  return result;
}

/// A disc of paper before the light, which comes through it.
CorpusScene lit_paper(Canvas canvas, Random& random) {
  CorpusScene result = penumbra(canvas, random);
  Material paper = matte({0.5, 0.45, 0.4});
  paper.diffuse_transmission = random.in(0.2, 0.5);
  scenes::add(result.scene, Disc{{random.in(-1, 1), 1.5, 1.5}, {0, 0, 1}, 0.8, 0, {}}, paper);
  return result;
}

/// A ball and a box under an area light behind bars: each point sees a different part of the light.
CorpusScene grating(Canvas canvas, Random& random) {
  CorpusScene result = floor_of(canvas, matte({0.8, 0.8, 0.8}));
  Scene& scene = result.scene;
  add_light(scene, RectLight{{-2, 4, -1}, {2, 0, 0}, {0, 0, 2}});
  scenes::add(scene, Sphere{{-0.7, 0.6, 0}, 0.6}, matte({0.8, 0.3, 0.2}));
  scenes::add(scene, Box{{0.5, 0, -0.3}, {1.2, 1, 0.4}}, matte({0.3, 0.4, 0.8}));
  const double start = random.in(-2.1, -1.9);
  for (int i = 0; i < 20; ++i) {
    const double x = start + 0.15 * i;
    scenes::add(scene, Box{{x, 2.5, -3}, {x + 0.07, 2.55, 3}}, matte({0.5, 0.5, 0.5}));
  }
  return result;
}

/// A hundred lights, most of them negligible at most points.
CorpusScene many_lights(Canvas canvas, Random& random) {
  CorpusScene result = floor_of(canvas, matte({0.8, 0.8, 0.8}));
  Scene& scene = result.scene;
  for (int i = 0; i < 100; ++i) {
    Light lamp = scenes::point_light({random.in(-4, 4), random.in(0.1, 1), random.in(-8, 3)}, random.color(0.2));
    lamp.intensity = 0.15;
    lamp.attenuation = {Attenuation::Kind::polynomial, {0.01, 0, 1}};
    scene.lights.push_back(lamp);
  }
  for (int i = 0; i < 12; ++i)
    scenes::add(scene, Sphere{{random.in(-2, 2), 0.2, random.in(-4, 2)}, 0.2}, matte(random.color(0.3)));
  return result;
}

/// A thousand balls on a floor, most of them smaller than a pixel.
CorpusScene pebbles(Canvas canvas, Random& random) {
  CorpusScene result = floor_of(canvas, matte({0.8, 0.8, 0.8}));
  add_light(result.scene, PointLight{{-4, 6, 5}});
  const MaterialId gray[] = {scenes::add(result.scene, matte({0.9, 0.85, 0.8})),
                             scenes::add(result.scene, matte({0.15, 0.1, 0.1}))};
  for (int i = 0; i < 1000; ++i) {
    const double radius = random.spread(0.003, 0.03);
    scenes::add(result.scene, Sphere{{random.in(-4, 4), radius, random.in(-9, 3)}, radius}, gray[i % 2]);
  }
  return result;
}

/// Squares about as large as a pixel: every pixel has an edge, and none is like its neighbor.
CorpusScene fine_checker(Canvas canvas, Random& random) {
  const double pixel = 2 * std::tan(std::numbers::pi / 9) * 10 / canvas.height;
  Texture texture;
  texture.pattern = CheckerTexture{{Color{0.05, 0.05, 0.05}, Color{0.9, 0.9, 0.9}}};
  texture.scale = {random.in(1, 1.2) / pixel, random.in(0.9, 1) / pixel};
  texture.filter = Texture::Filter::nearest;
  Material squares = matte({});
  squares.color = TextureId{0};
  CorpusScene result = floor_of(canvas, squares);
  result.scene.textures.push_back(texture);
  result.scene.camera = {{0, 10, 0}, {0, 0, 0.1}, {0, 0, -1}, 40};
  add_light(result.scene, PointLight{{-4, 6, 5}});
  return result;
}

/// Small bright balls, and curved mirrors that show them.
CorpusScene curved_mirrors(Canvas canvas, Random& random) {
  CorpusScene result = floor_of(canvas, matte({0.6, 0.6, 0.6}));
  add_light(result.scene, PointLight{{-4, 6, 5}});
  const MaterialId chrome = scenes::add(result.scene, scenes::mirror(0.9)),
                   glow = scenes::add(result.scene, scenes::glowing({4, 3, 2}));
  for (int i = 0; i < 6; ++i)
    scenes::add(result.scene, Sphere{{random.in(-2.5, 2.5), 0.6, random.in(-2, 2)}, 0.6}, chrome);
  for (int i = 0; i < 40; ++i)
    scenes::add(result.scene, Sphere{{random.in(-6, 6), random.in(0.1, 4), random.in(7.5, 12)}, 0.03}, glow);
  return result;
}

/// An environment with a sun of two texels, in balls that are a few pixels wide.
CorpusScene small_sun(Canvas canvas, Random& random) {
  constexpr std::uint32_t width = 256, height = 128;
  CorpusScene result = floor_of(canvas, matte({0.3, 0.3, 0.3}));
  Image sky{width, height, std::vector<float>(3 * width * height, 0.2F)};
  std::fill_n(sky.rgb.begin() + 3 * ((20 + random.below(20)) * width + random.below(width - 2)), 6, 60.0F);
  result.scene.assets = {{"sky.exr", "/background/environment/file"}};
  result.assets.bytes = {encode(sky, Format::exr)->bytes};
  result.scene.textures = {{.pattern = ImageTexture{AssetId{0}, ColorSpace::linear}, .path = {}}};
  result.scene.background.environment = Environment{TextureId{0}};
  result.scene.ambient = {1, 1, 1};
  const MaterialId chrome = scenes::add(result.scene, scenes::mirror(0.9));
  for (int i = 0; i < 60; ++i) {
    const double radius = random.spread(0.02, 0.2);
    scenes::add(result.scene, Sphere{{random.in(-3, 3), radius, random.in(-4, 3)}, radius}, chrome);
  }
  return result;
}

/// Steps of one object with equal normals and no shadows between them: signatures of neighbors agree across the edges.
CorpusScene equal_signatures(Canvas canvas, Random& random) {
  CorpusScene result;
  result.scene = orthographic_scene(canvas);
  const PointLight lamp{{random.in(-20, 20), random.in(-20, 20), 60}};
  result.scene.lights = {{lamp, {1, 1, 1}, 2000, false, {Attenuation::Kind::inverse_square, {}}}};
  Mesh steps;
  const auto add_step = [&](const Polygon& corners, double z) {
    const auto first = static_cast<std::uint32_t>(steps.positions.size());
    for (const Vec2& at : corners) steps.positions.push_back({at.x, at.y, z});
    steps.triangles.insert(steps.triangles.end(), {{first, first + 1, first + 2}, {first, first + 2, first + 3}});
  };
  for (const Vec2& place : random_places(canvas, random, 40, 12)) {
    const double z = random.in(0, 40), side = random.in(3, 8);
    add_step(rectangle(place, side, side, random.in(0, 1)), z);
  }
  add_step(rectangle({}, 2.0 * canvas.width, 2.0 * canvas.height), -5);
  scenes::add(result.scene, steps, matte({0.8, 0.8, 0.8}));
  return result;
}

template <class Bytes>
Bytes read_file(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw std::runtime_error("cannot read " + file.string());
  return Bytes(std::istreambuf_iterator<char>(stream), {});
}

/// An example scene of the repository, scaled to the canvas.
CorpusScene example(Canvas canvas, Random& /*random*/, const std::string& name) {
  const std::filesystem::path directory = WHITTLE_SOURCE_DIR "/scenes";
  api::Limits limits;
  limits.files = api::Files::anywhere;
  const auto read = [&](const std::string& file) -> api::AssetBytes {
    return read_file<std::vector<std::uint8_t>>(directory / file);
  };
  api::DocumentRender render;
  if (!render.parse(read_file<std::string>(directory / (name + ".json")), limits) || !render.load(read, limits.scene))
    throw std::runtime_error(name + " or one of its files is not valid");
  Scene& scene = render.document.scene;
  scene.image = {canvas.width, canvas.height};
  scene.accuracy = {};
  scene.output.palette = 0;
  scene.output.alpha = false;
  return {.scene = std::move(scene), .assets = std::move(render.assets)};
}

}  // namespace

std::vector<CorpusEntry> sampled_entries() {
  using enum SettingGroup;
  std::vector<CorpusEntry> entries{
      {"fixed samples", "bumps", fixed_samples, bumps, false},
      {"fixed samples", "floor of tiles", fixed_samples, tiled_floor, false},
      {"fixed samples", "penumbra", fixed_samples, penumbra, false},
      {"ordinary, sampled", "penumbra", budgets, penumbra, false},
      {"ordinary, sampled", "lit paper", targets, lit_paper, false},
      {"difficult, sampled", "area light through bars", targets, grating, false},
      {"difficult, sampled", "hundred lights", targets, many_lights, false},
      {"difficult, sampled", "pebbles", targets, pebbles, false},
      {"difficult, sampled", "checker of pixels", targets, fine_checker, false},
      {"difficult, sampled", "equal signatures", targets, equal_signatures, false},
      {"small things in mirrors", "bright balls in curved mirrors", targets, curved_mirrors, false},
      {"small things in mirrors", "a sun of two texels", targets, small_sun, false},
  };
  for (const char* name :
       {"whitted", "cornell", "glass", "shapes", "textures", "lights", "transparency", "tone", "lens", "relief", "haze",
        "shading", "instances", "isometric", "mesh_files", "local_models", "environment", "cube", "panorama"}) {
    const auto build = [name](Canvas canvas, Random& random) { return example(canvas, random, name); };
    entries.push_back({"examples", name, targets, build, false});
  }
  return entries;
}

}  // namespace error_coverage
