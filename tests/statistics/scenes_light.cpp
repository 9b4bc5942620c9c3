// Lights of every kind, their shadows and attenuation.
#include <cmath>

#include "tests/statistics/scene_corpus.h"
#include "tests/support/random.h"

namespace statistics {
namespace {

using namespace tracer;
using scenes::matte;

/// A ball and a box on a floor under the only light.
Case under(std::string name, std::string exercises, const LightSource& source) {
  Case c = lit_floor_case(std::move(name), std::move(exercises));
  c.scene.lights = {light_of(source)};
  scenes::add(c.scene, Sphere{{-0.7, 0.6, 0}, 0.6}, matte({0.8, 0.3, 0.2}));
  scenes::add(c.scene, Box{{0.5, 0, -0.3}, {1.2, 1, 0.4}}, matte({0.3, 0.4, 0.8}));
  return c;
}

Case spot() {
  Case c = under("spot", "a soft cone and a narrow one with a hard rim", SpotLight{{-2, 4, 2}, {0.5, -1, -0.5}, 8, 24});
  c.scene.lights.push_back(light_of(SpotLight{{3, 3, 2}, {-0.6, -0.8, -0.3}, 9.99, 10}, 0.7));
  return c;
}

Case suns() {
  Case c = under("suns", "two directional lights of their own colours", DirectionalLight{{0.4, -1, -0.3}});
  c.scene.lights[0].color = {1, 0.7, 0.3};
  c.scene.lights.push_back(scenes::directional_light({-0.8, -0.6, -0.2}, {0.1, 0.2, 0.5}));
  return c;
}

Case attenuated() {
  Case c = under("attenuated", "fading by a polynomial, by the inverse square, and a light without shadows",
                 PointLight{{-1.5, 1.5, 1.5}});
  c.scene.lights[0].attenuation = {Attenuation::Kind::polynomial, {0.1, 0.2, 0.3}};
  c.scene.lights.push_back(light_of(PointLight{{1.5, 0.7, 1.2}}, 0.5));
  c.scene.lights[1].attenuation.kind = Attenuation::Kind::inverse_square;
  c.scene.lights.push_back(light_of(PointLight{{0, 5, -2}}, 0.2));
  c.scene.lights[2].shadows = false;
  return c;
}

Case wide_penumbra() {
  return under("wide_penumbra", "a large rect light: penumbrae wider than their occluders",
               RectLight{{-3, 4, -2}, {4, 0, 0}, {0, 0, 4}});
}

Case narrow_penumbra() {
  return under("narrow_penumbra", "a small disc light: penumbrae of about a pixel",
               DiscLight{{-3, 5, 3}, {0.5, -0.8, -0.5}, 0.15});
}

Case line_light() { return under("line_light", "soft one way, hard the other", LineLight{{-3, 3, 1}, {2, 3, 1}}); }

Case sphere_light() {
  Case c = under("sphere_light", "contact: shadows that begin sharp and widen", SphereLight{{-3, 4, 3}, 1});
  for (int i = 0; i < 5; ++i)
    scenes::add(c.scene, Cylinder{{-2.0 + i, 0, 1.2}, {-2.0 + i, 0.8, 1.2}, 0.04, true, {}}, matte({0.2, 0.6, 0.3}));
  return c;
}

Case blocker() {
  Case c = lit_floor_case("blocker", "a ball in the middle of an area light: half of its points reach nothing");
  c.scene.lights = {light_of(RectLight{{-1.5, 3, -1.5}, {3, 0, 0}, {0, 0, 3}})};
  scenes::add(c.scene, Sphere{{0, 3, 0}, 0.9}, matte({0.5, 0.5, 0.5}));
  scenes::add(c.scene, Sphere{{1.2, 0.4, 0.5}, 0.4}, matte({0.8, 0.5, 0.2}));
  return c;
}

Case grating() {
  Case c = under("grating", "an area light through bars: light that is there or not, a hundred times", PointLight{});
  c.scene.lights = {light_of(RectLight{{-2, 4, -1}, {2, 0, 0}, {0, 0, 2}})};
  for (int i = 0; i < 20; ++i) {
    const double x = -2.0 + 0.15 * i;
    scenes::add(c.scene, Box{{x, 2.5, -3}, {x + 0.07, 2.55, 3}}, matte({0.5, 0.5, 0.5}));
  }
  return c;
}

Case coloured_shadows() {
  Case c = under("coloured_shadows", "light through panes of coloured, filtering and absorbing matter",
                 DiscLight{{-2, 5, 2}, {0, -1, 0}, 0.4});
  for (int i = 0; i < 3; ++i) {
    Material pane = matte({0.1, 0.1, 0.1});
    pane.transparency = Material::Transparency::filtered;
    pane.transmission = 0.9;
    pane.transmission_color = {i == 0 ? 1.0 : 0.2, i == 1 ? 1.0 : 0.2, i == 2 ? 1.0 : 0.2};
    if (i == 2) pane.absorption = {3, 1, 0.2};
    scenes::add(c.scene, Box{{-2.2 + 1.4 * i, 1.6, -0.5}, {-1.2 + 1.4 * i, 1.7, 1.5}}, pane);
  }
  return c;
}

Case many_lights() {
  Case c = lit_floor_case("many_lights", "a hundred lights: most of them culled where they are negligible");
  c.scene.lights.clear();
  oracle::Random draw(11);
  for (int i = 0; i < 100; ++i) {
    Light lamp = light_of(PointLight{{draw.in(-4, 4), draw.in(0.1, 1), draw.in(-8, 3)}}, 0.15);
    lamp.color = draw.color(0.2);
    lamp.attenuation = {Attenuation::Kind::polynomial, {0.01, 0, 1}};
    c.scene.lights.push_back(lamp);
  }
  for (int i = 0; i < 12; ++i)
    scenes::add(c.scene, Sphere{{draw.in(-2, 2), 0.2, draw.in(-4, 2)}, 0.2}, matte(draw.color(0.3)));
  return c;
}

Case clipped() {
  Case c = under("clipped", "light far brighter than white: most of the image is clamped", PointLight{{-2, 3, 3}});
  c.scene.lights[0].intensity = 6;
  c.scene.lights[0].attenuation = {Attenuation::Kind::polynomial, {0, 0, 0.2}};
  return c;
}

Case dark() {
  Case c = under("dark", "an image of a few code values, where the sRGB curve is steepest", PointLight{{-2, 3, 3}});
  c.scene.lights[0].intensity = 0.01;
  c.scene.background.color = c.scene.ambient = {0.0005, 0.0005, 0.001};
  return c;
}

Case highlights() {
  Case c = lit_floor_case("highlights", "local models, and highlights smaller than a pixel");
  const double shininess[] = {20, 5000, 100, 1e6};
  for (int i = 0; i < 4; ++i) {
    Material material = phong({0.3, 0.1, 0.1}, 3, shininess[i]);
    if (i % 2 == 0) material.model = Material::Model::blinn_phong;
    scenes::add(c.scene, Sphere{{-1.8 + 1.2 * i, 0.55, 0}, 0.55}, material);
  }
  c.scene.materials[0] = phong({0.2, 0.2, 0.2}, 0.8, 2000);
  return c;
}

}  // namespace

std::vector<Case> light_cases() {
  return {spot(),    suns(),    attenuated(),       wide_penumbra(), narrow_penumbra(), line_light(), sphere_light(),
          blocker(), grating(), coloured_shadows(), many_lights(),   clipped(),         dark(),       highlights()};
}

}  // namespace statistics
