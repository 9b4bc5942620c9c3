// Scenes without a closed form whose error is difficult to estimate: visibility that changes often, detail finer than
// pixels, and features of scenes that no other entry has.
#include <cmath>
#include <numbers>

#include "tests/statistics/error_coverage/corpus.h"
#include "tests/support/scenes.h"

namespace error_coverage {
namespace {

using namespace tracer;
using oracle::Random;
using scenes::matte;

/// Camera at (0, 1.5, 6), blue background, no object.
CorpusScene empty_scene(Canvas canvas) {
  CorpusScene result;
  Scene& scene = result.scene;
  scene.image = {canvas.width, canvas.height};
  scene.camera = {{0, 1.5, 6}, {0, 0.5, 0}, {0, 1, 0}, 40};
  scene.background.color = {0.1, 0.15, 0.25};
  scene.ambient = {0.1, 0.1, 0.1};
  return result;
}

/// A white floor, and a point light above to the left of the camera.
CorpusScene lit_floor(Canvas canvas) {
  CorpusScene result = empty_scene(canvas);
  scenes::add(result.scene, Plane{}, matte({0.8, 0.8, 0.8}));
  result.scene.lights.push_back(scenes::point_light({-4, 6, 5}, {0.9, 0.9, 0.9}));
  return result;
}

Material textured(Scene& scene, const Texture& texture) {
  scene.textures.push_back(texture);
  Material material = matte({});
  material.color = TextureId{static_cast<std::uint32_t>(scene.textures.size() - 1)};
  return material;
}

Texture checker(const Vec2& scale) {
  Texture texture;
  texture.pattern = CheckerTexture{{Color{0.05, 0.05, 0.05}, Color{0.9, 0.9, 0.9}}};
  texture.scale = scale;
  return texture;
}

/// A ball and a box under an area light behind bars: each point sees a different part of the light.
CorpusScene grating(Canvas canvas, Random& random) {
  CorpusScene result = lit_floor(canvas);
  Scene& scene = result.scene;
  Light lamp;
  lamp.source = RectLight{{-2, 4, -1}, {2, 0, 0}, {0, 0, 2}};
  scene.lights = {lamp};
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
  CorpusScene result = lit_floor(canvas);
  Scene& scene = result.scene;
  scene.lights.clear();
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

/// Bars finer than a pixel, far away and near.
CorpusScene lattice(Canvas canvas, Random& random) {
  CorpusScene result = empty_scene(canvas);
  Scene& scene = result.scene;
  scene.lights.push_back(scenes::directional_light({0.3, -1, -0.5}));
  const MaterialId bar = scenes::add(scene, matte({0.9, 0.9, 0.9}));
  const double shift = random.in(-0.1, 0.1);
  for (int i = 0; i < 25; ++i) {
    const double x = 0.25 * (i - 12) + shift;
    scenes::add(scene, Cylinder{{x, 0.2, 2}, {x, 0.6, -30}, 0.01, false, {}}, bar);
    scenes::add(scene, Cylinder{{-3, 1.2, x}, {3, 1.3, x}, 0.005, false, {}}, bar);
  }
  return result;
}

/// A thousand balls on a floor, most of them smaller than a pixel.
CorpusScene pebbles(Canvas canvas, Random& random) {
  CorpusScene result = lit_floor(canvas);
  const MaterialId gray[] = {scenes::add(result.scene, matte({0.9, 0.85, 0.8})),
                             scenes::add(result.scene, matte({0.15, 0.1, 0.1}))};
  for (int i = 0; i < 1000; ++i) {
    const double radius = random.spread(0.003, 0.03);
    scenes::add(result.scene, Sphere{{random.in(-4, 4), radius, random.in(-9, 3)}, radius}, gray[i % 2]);
  }
  return result;
}

/// Wires of 0.02 to 0.5 pixels, and their shadows.
CorpusScene wires(Canvas canvas, Random& random) {
  CorpusScene result = lit_floor(canvas);
  const double pixel = 2 * std::tan(std::numbers::pi / 9) * 6 / canvas.height, turn = random.in(0, 0.2);
  for (int i = 0; i < 8; ++i) {
    const double angle = std::numbers::pi * (i + 0.5) / 8 + turn, radius = pixel * 0.01 * std::pow(25.0, i / 7.0);
    scenes::add(result.scene,
                Cylinder{{0, 0.3, 0}, {2 * std::cos(angle), 0.3 + 1.2 * std::sin(angle), 0}, radius, true, {}},
                matte({0.9, 0.6, 0.2}));
  }
  return result;
}

/// Edges and shadows that only a mirror shows.
CorpusScene mirrored_edges(Canvas canvas, Random& random) {
  CorpusScene result = empty_scene(canvas);
  Scene& scene = result.scene;
  scene.lights.push_back(scenes::point_light({-2, 5, 8}));
  scenes::add(scene, Plane{{0, 0, -1}, {random.in(0, 0.2), 0, 1}, {}}, scenes::mirror(0.9));
  scenes::add(scene, Plane{{0, -0.5, 0}, {0, 1, 0}, {}}, matte({0.7, 0.7, 0.6}));
  for (int i = 0; i < 9; ++i)
    scenes::add(scene, Box{{-4.0 + i, -0.5, 7}, {-3.6 + i, 0.5 + 0.3 * (i % 3), 7.4}}, matte({0.9, 0.3, 0.1 * i}));
  return result;
}

/// Squares about as large as a pixel: every pixel has an edge, and none is like its neighbor.
CorpusScene fine_checker(Canvas canvas, Random& random) {
  CorpusScene result = lit_floor(canvas);
  Scene& scene = result.scene;
  scene.camera = {{0, 10, 0}, {0, 0, 0.1}, {0, 0, -1}, 40};
  const double pixel = 2 * std::tan(std::numbers::pi / 9) * 10 / canvas.height;
  Texture squares = checker({random.in(1, 1.2) / pixel, random.in(0.9, 1) / pixel});
  squares.filter = Texture::Filter::nearest;
  scene.objects[0].material = scenes::add(scene, textured(scene, squares));
  return result;
}

/// Two matte balls and a mirror, one behind the other.
CorpusScene row_of_balls(Canvas canvas) {
  CorpusScene result = empty_scene(canvas);
  Scene& scene = result.scene;
  scene.lights.push_back(scenes::point_light({-4, 6, 5}, {0.9, 0.9, 0.9}));
  scenes::add(scene, Sphere{{-1.1, 0.6, 2}, 0.6}, matte({0.8, 0.3, 0.2}));
  scenes::add(scene, Sphere{{0.2, 0.7, 0}, 0.7}, scenes::mirror(0.7));
  scenes::add(scene, Sphere{{1.8, 0.8, -3}, 0.8}, matte({0.2, 0.4, 0.8}));
  return result;
}

CorpusScene environment(Canvas canvas, Random& random) {
  CorpusScene result = row_of_balls(canvas);
  result.scene.textures.push_back(checker({24, 12}));
  result.scene.background.environment = Environment{{0}, random.in(0, 90)};
  return result;
}

/// Another texture on each face, in a view that shows three of them.
CorpusScene cube_map(Canvas canvas, Random& random) {
  CorpusScene result = row_of_balls(canvas);
  CubeMap faces;
  for (std::uint32_t i = 0; i < 6; ++i) {
    Texture face = checker({2 + 2.0 * i, 2 + 2.0 * i});
    if (i % 2 == 0) face.pattern = NoiseTexture{{Color{0.1, 0.1 * i, 0.4}, Color{1, 0.8, 0.1 * i}}, 3};
    result.scene.textures.push_back(face);
    faces.faces[i] = {i};
  }
  result.scene.background.cube = faces;
  result.scene.camera.fov_deg = random.in(65, 80);
  return result;
}

/// At the poles, the pixels of a row have nearly the same direction.
CorpusScene panorama(Canvas canvas, Random& random) {
  CorpusScene result = row_of_balls(canvas);
  Scene& scene = result.scene;
  scenes::add(scene, Plane{}, textured(scene, checker({1, 1})));
  scene.camera.type = Camera::Type::panorama;
  scene.camera.position = {random.in(-0.3, 0.3), 1.2, 1.5};
  return result;
}

}  // namespace

std::vector<CorpusEntry> difficult_entries() {
  const auto entry = [](const char* name, CorpusScene (*build)(Canvas, Random&)) {
    return CorpusEntry{"difficult, sampled", name, SettingGroup::targets, build, false};
  };
  return {entry("area light through bars", grating),
          entry("hundred lights", many_lights),
          entry("lattice", lattice),
          entry("pebbles", pebbles),
          entry("wires and their shadows", wires),
          entry("edges in a mirror", mirrored_edges),
          entry("checker of pixels", fine_checker),
          entry("environment", environment),
          entry("cube map", cube_map),
          entry("panorama", panorama)};
}

}  // namespace error_coverage
