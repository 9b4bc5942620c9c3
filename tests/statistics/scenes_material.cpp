// Mirrors, glass and other reflecting or transmitting materials.
#include "tests/statistics/scene_corpus.h"

namespace statistics {
namespace {

using namespace tracer;
using scenes::matte;

/// A checkered floor and a bright ball behind the transparent objects.
Case behind(std::string name, std::string exercises) {
  Case c = lit_floor_case(std::move(name), std::move(exercises));
  Texture squares = checker(1.3);
  squares.filter = Texture::Filter::nearest;
  c.scene.objects[0].material = scenes::add(c.scene, textured(c.scene, squares));
  scenes::add(c.scene, Sphere{{0.6, 0.7, -3}, 0.7}, matte({0.9, 0.5, 0.1}));
  return c;
}

Material clear(double ior) {
  Material glass = scenes::glass(ior);
  glass.specular = 0.3;
  glass.shininess = 100;
  return glass;
}

Case mirror_balls() {
  Case c = behind("mirror_balls", "curved mirrors that see each other");
  for (int i = 0; i < 3; ++i) {
    Material mirror = phong({0.1, 0.1, 0.1}, 0.4, 80);
    mirror.reflection = 0.8;
    mirror.reflection_color = {1, 0.9 - 0.2 * i, 0.6 + 0.2 * i};
    scenes::add(c.scene, Sphere{{-1.4 + 1.4 * i, 0.7, 0}, 0.65}, mirror);
  }
  return c;
}

Case mirrored_edges() {
  Case c = empty_case("mirrored_edges", "edges and shadows that only a mirror shows");
  c.scene.lights.push_back(scenes::point_light({-2, 5, 8}));
  scenes::add(c.scene, Plane{{0, 0, -1}, {0.1, 0, 1}, {}}, scenes::mirror(0.9));
  scenes::add(c.scene, Plane{{0, -0.5, 0}, {0, 1, 0}, {}}, matte({0.7, 0.7, 0.6}));
  for (int i = 0; i < 9; ++i)
    scenes::add(c.scene, Box{{-4.0 + i, -0.5, 7}, {-3.6 + i, 0.5 + 0.3 * (i % 3), 7.4}}, matte({0.9, 0.3, 0.1 * i}));
  return c;
}

Case corridor() {
  Case c = empty_case("corridor", "two mirrors face each other: hundreds of bounces, cut off by weight");
  c.scene.camera = {{0.3, 0.6, 0.9}, {-0.1, 0.5, -1}, {0, 1, 0}, 60};
  c.scene.lights.push_back(scenes::point_light({0, 1.8, 0}));
  for (const double z : {-1.0, 1.0}) {
    Material mirror = scenes::mirror(0.97);
    mirror.reflection_color = {1, 0.98, 0.95};
    scenes::add(c.scene, Plane{{0, 0, z}, {0, 0, -z}, {}}, mirror);
  }
  scenes::add(c.scene, Plane{}, matte({0.6, 0.6, 0.6}));
  scenes::add(c.scene, Plane{{0, 2.5, 0}, {0, -1, 0}, {}}, matte({0.3, 0.4, 0.6}));
  scenes::add(c.scene, Sphere{{-0.3, 0.3, 0}, 0.3}, matte({0.8, 0.3, 0.2}));
  return c;
}

Case glass_ball() {
  Case c = behind("glass_ball", "a solid ball of glass with Fresnel's reflectance, and one of diamond");
  scenes::add(c.scene, Sphere{{-0.7, 0.8, 0.3}, 0.75}, clear(1.5));
  scenes::add(c.scene, Sphere{{1.2, 0.5, 1}, 0.5}, clear(2.4));
  return c;
}

Case bubbles() {
  Case c = behind("bubbles", "thin shells: glass around air, and air in water");
  scenes::add(c.scene, Sphere{{-0.8, 0.8, 0.3}, 0.75}, clear(1.5));
  Material air = scenes::glass(1);  // without a reflection of its own: light caught between the two has few ways
  air.fresnel = false;
  air.reflection = 0;
  scenes::add(c.scene, Sphere{{-0.8, 0.8, 0.3}, 0.7}, air);
  Material bubble = scenes::glass(0.75);
  bubble.fresnel = false;
  bubble.reflection = 0.1;
  scenes::add(c.scene, Sphere{{1, 0.7, 0.5}, 0.6}, bubble);
  return c;
}

Case nested() {
  Case c = behind("nested", "a glass of water: overlapping solids of two priorities, one absorbing");
  Material cup = clear(1.5), water = clear(1.33);
  cup.priority = 2;
  water.priority = 1;
  water.absorption = {1.2, 0.4, 0.1};
  scenes::add(c.scene, Cylinder{{0, 0.05, 0.5}, {0, 1.5, 0.5}, 0.8, true, {}}, cup);
  scenes::add(c.scene, Cylinder{{0, 0.2, 0.5}, {0, 1.1, 0.5}, 0.7, true, {}}, water);
  return c;
}

Case amber() {
  Case c = behind("amber", "absorbing glass boxes: a different length through each pixel");
  for (int i = 0; i < 3; ++i) {
    Material glass = clear(1.3);
    glass.absorption = {0.1, 0.6 + 0.3 * i, 2};
    scenes::add(c.scene, Box{{-0.4, 0.1, -0.4}, {0.4, 1.1, 0.4}}, glass);
    c.scene.objects.back().transform = turned(20 + 25.0 * i, {-1.4 + 1.3 * i, 0, 0.5});
  }
  return c;
}

Case prism() {
  Case c = behind("prism", "total internal reflection: a critical angle within pixels");
  Mesh wedge;
  for (const double z : {0.6, -0.6})
    for (const Vec2& corner : {Vec2{-1, 0.1}, Vec2{1, 0.1}, Vec2{0, 1.6}})  // turned by 37 degrees: a 3-4-5 triangle's
      wedge.positions.push_back({0.8 * corner.x + 0.6 * z - 0.2, corner.y, -0.6 * corner.x + 0.8 * z + 0.5});
  wedge.triangles = {{0, 1, 2}, {3, 5, 4}, {0, 3, 4}, {0, 4, 1}, {1, 4, 5}, {1, 5, 2}, {2, 5, 3}, {2, 3, 0}};
  scenes::add(c.scene, wedge, clear(1.52));
  return c;
}

Case panes(std::string name, std::string exercises, Material::Transparency transparency) {
  Case c = behind(std::move(name), std::move(exercises));
  for (int i = 0; i < 4; ++i) {
    Material pane = phong({0.8, 0.3 * i, 0.2}, 0.3, 30);
    pane.transparency = transparency;
    pane.transmission = 0.2 + 0.2 * i;
    pane.transmission_color = {0.9, 0.95, 1};
    scenes::add(c.scene, Disc{{-1.5 + i, 0.9, 0.4 * i}, {0.3, 0, 1}, 0.8, 0, {}}, pane);
  }
  return c;
}

Case mixed() {
  Case c = behind("mixed", "reflection and refraction without Fresnel: every hit branches");
  for (int i = 0; i < 3; ++i) {
    Material both = phong({0.2, 0.1, 0.1}, 0.2, 40);
    both.reflection = 0.2;
    both.transmission = 0.4;
    both.ior = 1.2 + 0.2 * i;
    scenes::add(c.scene, Sphere{{-1.3 + 1.3 * i, 0.7, 0.2}, 0.6}, both);
  }
  return c;
}

}  // namespace

std::vector<Case> material_cases() {
  return {mirror_balls(),
          mirrored_edges(),
          corridor(),
          glass_ball(),
          bubbles(),
          nested(),
          amber(),
          prism(),
          panes("interpolated", "panes that mix what is behind with their own colour",
                Material::Transparency::interpolated),
          panes("filtered", "panes that colour what is behind", Material::Transparency::filtered),
          mixed()};
}

}  // namespace statistics
