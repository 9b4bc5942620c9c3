// Cameras, environments and display transforms.
#include "tests/statistics/scene_corpus.h"

namespace statistics {
namespace {

using namespace tracer;
using scenes::matte;

/// Three balls on a floor, one behind the other, one of them a mirror.
Case row(std::string name, std::string exercises) {
  Case c = lit_floor_case(std::move(name), std::move(exercises));
  scenes::add(c.scene, Sphere{{-1.1, 0.6, 2}, 0.6}, matte({0.8, 0.3, 0.2}));
  Material mirror = phong({0.1, 0.1, 0.1}, 0.4, 60);
  mirror.reflection = 0.7;
  scenes::add(c.scene, Sphere{{0.2, 0.7, 0}, 0.7}, mirror);
  scenes::add(c.scene, Sphere{{1.8, 0.8, -3}, 0.8}, matte({0.2, 0.4, 0.8}));
  return c;
}

Case environment() {
  Case c = row("environment", "a world of checkers, turned, seen directly and in a mirror");
  c.scene.objects.erase(c.scene.objects.begin());
  c.scene.textures.push_back(checker(1));
  c.scene.textures[0].scale = {24, 12};
  c.scene.background.environment = Environment{{0}, 37};
  return c;
}

Case cube() {
  Case c = row("cube", "six faces of their own textures around the world");
  c.scene.objects.erase(c.scene.objects.begin());
  CubeMap faces;
  for (std::uint32_t i = 0; i < 6; ++i) {
    Texture face = checker(2 + 2.0 * i);
    if (i % 2 == 0) face.pattern = NoiseTexture{{Color{0.1, 0.1 * i, 0.4}, Color{1, 0.8, 0.1 * i}}, 3};
    c.scene.textures.push_back(face);
    faces.faces[i] = {i};
  }
  c.scene.background.cube = faces;
  c.scene.camera.fov_deg = 75;
  return c;
}

Case sky() {
  Case c = row("sky", "a gradient of a sky, and one through a mirror");
  c.scene.background.gradient = Gradient{{0.1, 0.2, 0.6}, {0.9, 0.8, 0.7}};
  return c;
}

Case lens() {
  Case c = row("lens", "out of focus before and behind: every pixel an integral over the lens");
  c.scene.camera.aperture = 0.3;
  c.scene.camera.focus_distance = 6;
  return c;
}

Case orthographic() {
  Case c = row("orthographic", "parallel rays");
  c.scene.camera.type = Camera::Type::orthographic;
  c.scene.camera.height = 4;
  return c;
}

Case panorama() {
  Case c = row("panorama", "all directions: rows of pixels that all look the same way at the poles");
  c.scene.image = {64, 32};
  c.scene.camera.type = Camera::Type::panorama;
  c.scene.camera.position = {0, 1.2, 1.5};
  return c;
}

Case depth_cue() {
  Case c = row("depth_cue", "fog over a floor of squares, and over what hits nothing");
  c.scene.objects[0].material = scenes::add(c.scene, textured(c.scene, checker(1)));
  c.scene.depth_cue = DepthCue{4, 14, 1, 0.1, {0.6, 0.65, 0.7}};
  return c;
}

Case exposed() {
  Case c = row("exposed", "two stops brighter: errors in the dark grow with it");
  c.scene.output.exposure = 2;
  return c;
}

Case scaled() {
  Case c = row("scaled", "divided by its brightest channel, which is itself an estimate");
  c.scene.output.overflow = Output::Overflow::scale;
  scenes::add(c.scene, Sphere{{-0.3, 1.6, -1}, 0.2}, scenes::glowing({4, 3, 2}));
  return c;
}

Case reinhard() {
  Case c = row("reinhard", "a curve that never reaches white, over a bright lamp");
  c.scene.output.overflow = Output::Overflow::reinhard;
  scenes::add(c.scene, Sphere{{-0.3, 1.6, -1}, 0.3}, scenes::glowing({20, 15, 10}));
  return c;
}

Case transparent() {
  Case c = row("transparent", "a transparent background, which counts as black");
  c.scene.objects.erase(c.scene.objects.begin());
  c.scene.background.color = {0.9, 0.9, 0.9};
  c.scene.output.alpha = true;
  return c;
}

Case cropped() {
  Case c = row("cropped", "a window of a larger image, at an odd place");
  c.scene.image = {160, 120, PixelWindow{37, 51, 87, 86}};
  return c;
}

Case calm() {
  Case c = empty_case("calm", "nothing but smooth shading: no error, and an estimate of 0");
  c.scene.lights.push_back(light_of(PointLight{{-1, 3, 2}}));
  scenes::add(c.scene, Plane{{0, 0, -2}, {0, 0, 1}, {}}, phong({0.6, 0.5, 0.4}, 0.3, 5));
  return c;
}

}  // namespace

std::vector<Case> view_cases() {
  return {environment(), cube(),   sky(),      lens(),        orthographic(), panorama(), depth_cue(),
          exposed(),     scaled(), reinhard(), transparent(), cropped(),      calm()};
}

}  // namespace statistics
