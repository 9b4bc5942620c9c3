// Global light with closed forms: every pixel is noisy, and a part of the noise is in rare, bright paths.
#include <cmath>
#include <numbers>

#include "tests/statistics/error_coverage/corpus.h"
#include "tests/support/scenes.h"
#include "tracer/encode.h"
#include "tracer/src/math/vec.h"

namespace error_coverage {
namespace {

using namespace tracer;
using oracle::Random;

Material surface(const Color& color, const Color& emission = {}) {
  Material material = scenes::matte(color);
  material.emission = emission;
  return material;
}

Image image_of(Canvas canvas, const std::function<Color(double x, double y)>& radiance) {
  Image image{canvas.width, canvas.height, {}};
  for (std::uint32_t y = 0; y < canvas.height; ++y)
    for (std::uint32_t x = 0; x < canvas.width; ++x) {
      const Color color = radiance(x + 0.5 - canvas.width / 2.0, canvas.height / 2.0 - y - 0.5);
      for (const double channel : {color.r, color.g, color.b}) image.rgb.push_back(static_cast<float>(channel));
    }
  return image;
}

/// Irradiance at (x, y, 0) over pi of a sphere of radiance 1 that is above the ground.
double irradiance(const Sphere& lamp, double x, double y) {
  const Vec3 to = lamp.center - Vec3{x, y, 0};
  return lamp.radius * lamp.radius * to.z / std::pow(dot(to, to), 1.5);
}

/// An empty scene of global light.
CorpusScene global_scene(Canvas canvas) {
  CorpusScene result;
  result.scene = orthographic_scene(canvas);
  result.scene.accuracy.model = Accuracy::Model::global;
  return result;
}

/// A ground under a sphere of this radiance.
CorpusScene lit_ground(Canvas canvas, const Color& color, const Sphere& lamp, double glow) {
  CorpusScene result = global_scene(canvas);
  scenes::add(result.scene, Plane{{0, 0, 0}, {0, 0, 1}, {}}, surface(color));
  scenes::add(result.scene, lamp, scenes::glowing({glow, glow, glow}));
  result.exact = image_of(canvas, [=](double x, double y) { return color * (glow * irradiance(lamp, x, y)); });
  return result;
}

constexpr Color sand{0.8, 0.6, 0.3};

/// The lamp is behind the camera, with a radius of that part of its height.
CorpusScene sphere_lamp(Canvas canvas, Random& random, double part, const Color& color = sand) {
  const double height = 20.0 * canvas.width, aside = random.in(-0.3, 0.3) * canvas.width;
  return lit_ground(canvas, color, Sphere{{aside, 0, height}, part * height}, 0.6 / (part * part));
}

/// A lamp close to the ground beside the image, so that a few pixels are far brighter than the others.
CorpusScene low_lamp(Canvas canvas, Random& random) {
  const double w = canvas.width;
  return lit_ground(canvas, sand, Sphere{{0.8 * w, random.in(-0.3, 0.3) * w, 0.1 * w}, 0.05 * w}, 60);
}

/// A wall of mirror shows the lamp once more: no ray toward an emitter finds that light.
CorpusScene mirrored_lamp(Canvas canvas, Random& random) {
  const double w = canvas.width, aside = random.in(-0.3, 0.3) * w;
  const Sphere lamp{{aside, 0, 10 * w}, 2 * w}, image{{-6 * w - aside, 0, 10 * w}, 2 * w};
  CorpusScene result = lit_ground(canvas, sand, lamp, 15);
  scenes::add(result.scene, Plane{{-3 * w, 0, 0}, {1, 0, 0}, {}}, scenes::mirror(1));
  result.exact = image_of(
      canvas, [=](double x, double y) { return sand * (15 * (irradiance(lamp, x, y) + irradiance(image, x, y))); });
  return result;
}

/// A lamp behind a pane that lets half of its light through, and no ray toward an emitter.
CorpusScene lamp_behind_pane(Canvas canvas, Random& random) {
  CorpusScene result = sphere_lamp(canvas, random, 0.25);
  Material pane = surface({0, 0, 0});
  pane.transparency = Material::Transparency::filtered;
  pane.transmission = 0.5;
  scenes::add(result.scene, Plane{{0, 0, 9.0 * canvas.width}, {0, 0, 1}, {}}, pane);
  for (float& value : result.exact->rgb) value /= 2;
  return result;
}

/// A dark room: the sky shines through a round hole in its ceiling.
CorpusScene hole(Canvas canvas, Random& random) {
  CorpusScene result = global_scene(canvas);
  result.scene.background.color = {20, 16, 10};
  const double w = canvas.width, height = 10 * w, radius = 1.5 * w, rim = 1e4 * w;
  const double aside = random.in(-0.3, 0.3) * w;
  scenes::add(result.scene, Plane{{0, 0, 0}, {0, 0, 1}, {}}, surface(sand));
  scenes::add(result.scene, Disc{{aside, 0, height}, {0, 0, 1}, rim, radius, {}}, surface({0, 0, 0}));
  // Form factor of a parallel disc (Howell, Menguc, "A Catalog of Radiation Heat Transfer Configuration Factors",
  // B-13).
  const auto part = [=](double squared, double r) {
    const double sum = squared + height * height + r * r;
    return (1 - (sum - 2 * r * r) / std::sqrt(sum * sum - 4 * squared * r * r)) / 2;
  };
  const Color sky = result.scene.background.color;
  result.exact = image_of(canvas, [=](double x, double y) {
    const double squared = (x - aside) * (x - aside) + y * y;
    return sand * sky * (part(squared, radius) + 1 - part(squared, rim));
  });
  return result;
}

/// A closed room in which every surface emits what it absorbs of the radiance 0.4: a ball in each corner of a square.
CorpusScene furnace(Canvas canvas, Random& random, double absorptance) {
  CorpusScene result = global_scene(canvas);
  constexpr double level = 0.4;
  const auto balanced = [&](const Color& color) {
    return surface(color, {level * (1 - color.r), level * (1 - color.g), level * (1 - color.b)});
  };
  const double side = 2.0 * canvas.width, kept = 1 - absorptance;
  scenes::add(result.scene, Box{{-side, -side, -side}, {side, side, 9.0 * canvas.width}}, balanced({kept, kept, kept}));
  for (const double x : {-0.25, 0.25})
    for (const double y : {-0.25, 0.25}) {
      Material ball = balanced({random.in(0, kept), random.in(0, kept), random.in(0, kept)});
      if (x < 0 && y < 0) {  // one lets light through
        ball = balanced({0.7, 0.7, 0.7});
        ball.color = Color{0.3, 0.3, 0.3};
        ball.diffuse_transmission = 0.4;
      }
      const double radius = random.in(0.05, 0.2) * canvas.height;
      scenes::add(result.scene, Sphere{{x * canvas.width, y * canvas.height, 0}, radius}, ball);
    }
  result.exact = image_of(canvas, [](double, double) { return Color{level, level, level}; });
  return result;
}

/// A ground beside a black wall under a sky: half of the sky is in sight. The wall is in any direction: along an axis
/// it would divide the stratified directions in halves, without an error.
CorpusScene half_sky(Canvas canvas, Random& random) {
  CorpusScene result = global_scene(canvas);
  const Color ground = random.color(0.2), sky = random.color(0.2);
  result.scene.background.color = sky;
  scenes::add(result.scene, Plane{{0, 0, 0}, {0, 0, 1}, {}}, surface(ground));
  const double azimuth = random.in(0, 2 * std::numbers::pi);
  const Vec3 normal{std::cos(azimuth), std::sin(azimuth), 0};
  scenes::add(result.scene, Plane{normal * (-1.0 * canvas.width), normal, {}}, surface({0, 0, 0}));
  result.exact = image_of(canvas, [=](double, double) { return ground * sky * 0.5; });
  return result;
}

/// A wall of mirror shows a lamp that a black disc hides from the ground.
CorpusScene hidden_lamp(Canvas canvas, Random& random) {
  const double w = canvas.width, y = random.in(-0.3, 0.3) * w;
  CorpusScene result = lit_ground(canvas, sand, Sphere{{5 * w, y, 10 * w}, 2 * w}, 25);
  scenes::add(result.scene, Plane{{-3 * w, 0, 0}, {1, 0, 0}, {}}, scenes::mirror(1));
  scenes::add(result.scene, Disc{{1.8 * w, 0.35 * y, 3.5 * w}, {0, 0, 1}, 1.25 * w, 0, {}}, surface({0, 0, 0}));
  const Sphere image{{-11 * w, y, 10 * w}, 2 * w};
  result.exact = image_of(canvas, [=](double px, double py) { return sand * (25 * irradiance(image, px, py)); });
  return result;
}

/// Eighty-one lamps, whose powers are up to 1,000 apart.
CorpusScene many_lamps(Canvas canvas, Random& random) {
  CorpusScene result = global_scene(canvas);
  scenes::add(result.scene, Plane{{0, 0, 0}, {0, 0, 1}, {}}, surface(sand));
  struct Lamp {
    Sphere sphere;
    Color glow;
  };
  std::vector<Lamp> lamps;
  const double w = canvas.width;
  for (int column = -4; column <= 4; ++column)
    for (int row = -4; row <= 4; ++row) {
      const double glow = 20 * std::pow(10, random.in(-3, 0));
      const Sphere sphere{{4 * w * column, 4 * w * row, 20 * w}, random.in(0.1, 1) * w};
      lamps.push_back({sphere, Color{random.in(0, glow), random.in(0, glow), random.in(0, glow)}});
      scenes::add(result.scene, sphere, scenes::glowing(lamps.back().glow));
    }
  result.exact = image_of(canvas, [=](double x, double y) {
    Color sum;
    for (const Lamp& lamp : lamps) sum += sand * lamp.glow * irradiance(lamp.sphere, x, y);
    return sum;
  });
  return result;
}

/// Parallel to the axes u and v, in `parts` x `parts` cells of two triangles.
Mesh grid(const Vec3& corner, const Vec3& u, const Vec3& v, std::uint32_t parts) {
  Mesh mesh;
  for (std::uint32_t row = 0; row <= parts; ++row)
    for (std::uint32_t column = 0; column <= parts; ++column)
      mesh.positions.push_back(corner + u * (1.0 * column / parts) + v * (1.0 * row / parts));
  for (std::uint32_t row = 0; row < parts; ++row)
    for (std::uint32_t column = 0; column < parts; ++column) {
      const std::uint32_t at = row * (parts + 1) + column, above = at + parts + 1;
      mesh.triangles.push_back({at, at + 1, above + 1});
      mesh.triangles.push_back({at, above + 1, above});
    }
  return mesh;
}

/// Form factor from a surface element to a rectangle [0, a] x [0, b] whose corner is above it at the distance `height`,
/// odd in both sides (Howell, Menguc, "A Catalog of Radiation Heat Transfer Configuration Factors", B-3).
double factor_of_parallel(double a, double b, double height) {
  const double x = a / height, y = b / height, along_x = std::sqrt(1 + x * x), along_y = std::sqrt(1 + y * y);
  return (x / along_x * std::atan(y / along_x) + y / along_y * std::atan(x / along_y)) / (2 * std::numbers::pi);
}

/// A lamp of 800 triangles.
CorpusScene mesh_lamp(Canvas canvas, Random& random) {
  CorpusScene result = global_scene(canvas);
  const double w = canvas.width, left = random.in(-1, 0) * w, low = random.in(-1, 0) * w, side = 2 * w, z = 9 * w;
  scenes::add(result.scene, Plane{{0, 0, 0}, {0, 0, 1}, {}}, surface(sand));
  scenes::add(result.scene, grid({left, low, z}, {side, 0, 0}, {0, side, 0}, 20), scenes::glowing({15, 15, 15}));
  result.exact = image_of(canvas, [=](double x, double y) {
    const double x0 = left - x, x1 = x0 + side, y0 = low - y, y1 = y0 + side;
    return sand * (15 * (factor_of_parallel(x1, y1, z) - factor_of_parallel(x0, y1, z) - factor_of_parallel(x1, y0, z) +
                         factor_of_parallel(x0, y0, z)));
  });
  return result;
}

/// A glowing wall that stands on the ground: the pixels beside it are next to the lamp.
CorpusScene corner_light(Canvas canvas, Random& random) {
  CorpusScene result = global_scene(canvas);
  const double w = canvas.width, wall = -0.501 * w, height = random.in(0.2, 0.6) * w, side = random.in(0.5, 1) * w;
  scenes::add(result.scene, Plane{{0, 0, 0}, {0, 0, 1}, {}}, surface(sand));
  scenes::add(result.scene, grid({wall, -side, 0}, {0, 2 * side, 0}, {0, 0, height}, 1), scenes::glowing({2, 2, 2}));
  // Form factor from an element to a rectangle at a right angle, from beside its corner: the same catalog, B-4.
  const auto factor = [=](double distance, double part) {
    const double slant = std::hypot(distance, height);
    return (std::atan(part / distance) - distance / slant * std::atan(part / slant)) / (2 * std::numbers::pi);
  };
  result.exact = image_of(canvas, [=](double x, double y) {
    return sand * (2 * (factor(x - wall, side - y) + factor(x - wall, side + y)));
  });
  return result;
}

/// A sky of one radiance with a sun of ten texels, nearly as bright as the rest together.
CorpusScene sunny_sky(Canvas canvas, Random& random) {
  constexpr std::uint32_t columns = 512, rows = 256;
  constexpr double pi = std::numbers::pi;
  CorpusScene result = global_scene(canvas);
  Image sky{columns, rows, {}};
  const auto left = static_cast<std::uint32_t>(random.in(8, 100)), top = static_cast<std::uint32_t>(random.in(64, 190));
  Color irradiance;  // over pi, of the ground that z is perpendicular to: u = 0 is z, and a quarter beside it is seen
  for (std::uint32_t row = 0; row < rows; ++row)
    for (std::uint32_t column = 0; column < columns; ++column) {
      const bool sun = column - left < 5 && row - top < 2;
      const Color radiance = sun ? Color{500, 450, 300} : Color{0.1, 0.2, 0.4};
      for (const double channel : {radiance.r, radiance.g, radiance.b}) sky.rgb.push_back(static_cast<float>(channel));
      if (column >= columns / 4 && column < columns * 3 / 4) continue;
      const auto along = [](double v) { return pi * (0.5 - v / rows) / 2 + std::sin(2 * pi * (0.5 - v / rows)) / 4; };
      const auto across = [](double u) { return std::sin(2 * pi * u / columns); };
      irradiance += radiance * ((along(row) - along(row + 1.0)) * (across(column + 1.0) - across(column)) / pi);
    }
  Texture texture;
  texture.pattern = ImageTexture{};
  texture.filter = Texture::Filter::nearest;
  texture.path = "/background/environment";
  result.scene.textures.push_back(texture);
  result.scene.assets = {{"sky.exr", "/background/environment/file"}};
  result.scene.background.environment = Environment{};
  result.assets = {{encode(sky, Format::exr)->bytes}};
  scenes::add(result.scene, Plane{{0, 0, 0}, {0, 0, 1}, {}}, surface(sand));
  result.exact = image_of(canvas, [=](double, double) { return sand * irradiance; });
  return result;
}

/// A leaf that is lit from behind.
CorpusScene leaf(Canvas canvas, Random& random) {
  CorpusScene result = global_scene(canvas);
  const double w = canvas.width;
  const Sphere lamp{{random.in(-0.3, 0.3) * w, 0, -10 * w}, 3 * w}, mirrored{{lamp.center.x, 0, 10 * w}, 3 * w};
  Material material = surface({0.05, 0.05, 0.05});
  material.diffuse_transmission = 0.6;
  material.diffuse_transmission_color = sand;
  scenes::add(result.scene, Plane{{0, 0, 0}, {0, 0, 1}, {}}, material);
  scenes::add(result.scene, lamp, scenes::glowing({10, 10, 10}));
  result.exact = image_of(canvas, [=](double x, double y) { return sand * (6 * irradiance(mirrored, x, y)); });
  return result;
}

/// A sphere with a light inside, seen from its middle: light that was reflected is the same everywhere (Hardy, Pineo
/// 1931, "The Errors Due to the Finite Size of Holes and Sample in Integrating Spheres").
CorpusScene integrating_sphere(Canvas canvas, Random& random) {
  CorpusScene result = global_scene(canvas);
  const double radius = canvas.width, intensity = 0.2 * radius * radius;
  const Color color{random.in(0.2, 0.7), random.in(0.2, 0.7), random.in(0.2, 0.7)};
  const Vec3 light{random.in(-0.3, 0.3) * radius, random.in(-0.3, 0.3) * radius, random.in(-0.3, 0.3) * radius};
  result.scene.camera.position = {0, 0, 0};
  result.scene.camera.look_at = {0, 0, -1};
  scenes::add(result.scene, Sphere{{0, 0, 0}, radius}, surface(color));
  result.scene.lights.push_back(scenes::point_light(light, {intensity, intensity, intensity}));
  result.scene.lights.back().attenuation.kind = Attenuation::Kind::inverse_square;
  result.exact = image_of(canvas, [=](double x, double y) {
    const Vec3 at{x, y, -std::sqrt(radius * radius - x * x - y * y)}, to = light - at;
    const double direct = intensity * -dot(to, at) / radius / std::pow(dot(to, to), 1.5);
    const double indirect = intensity / (radius * radius);
    const auto radiance = [&](double rho) { return rho * direct + rho * rho * indirect / (1 - rho); };
    return Color{radiance(color.r), radiance(color.g), radiance(color.b)};
  });
  return result;
}

/// Two parallel planes, of which one glows. No emitter is sampled.
CorpusScene parallel_planes(Canvas canvas, Random& random) {
  CorpusScene result = global_scene(canvas);
  const Color ground = random.color(0.2), ceiling = random.color(0.2);
  scenes::add(result.scene, Plane{{0, 0, 0}, {0, 0, 1}, {}}, surface(ground * 0.9));
  scenes::add(result.scene, Plane{{0, 0, 9.0 * canvas.width}, {0, 0, 1}, {}}, surface(ceiling * 0.9, {0.3, 0.3, 0.3}));
  result.exact = image_of(canvas, [=](double, double) {
    const auto radiance = [](double rho, double other) { return 0.9 * rho * 0.3 / (1 - 0.81 * rho * other); };
    return Color{radiance(ground.r, ceiling.r), radiance(ground.g, ceiling.g), radiance(ground.b, ceiling.b)};
  });
  return result;
}

/// A closed room with a lamp in its ceiling, a ball of glass and one of mirror.
CorpusScene room(Canvas canvas, Random& random) {
  CorpusScene result = global_scene(canvas);
  const double w = canvas.width;
  scenes::add(result.scene, Box{{-w, -w, 0}, {w, w, 9 * w}}, surface({0.7, 0.7, 0.7}));
  scenes::add(result.scene, grid({-0.9 * w, 0.999 * w, 0.2 * w}, {1.8 * w, 0, 0}, {0, 0, w}, 1),
              scenes::glowing({4, 3.5, 3}));
  const auto add_ball = [&](double x, const Material& material) {
    const double radius = random.in(0.1, 0.2) * w;
    scenes::add(result.scene, Sphere{{x * w, random.in(-0.1, 0.1) * w, radius}, radius}, material);
  };
  add_ball(-0.25, scenes::glass());
  add_ball(0.25, scenes::mirror(0.9));
  return result;
}

}  // namespace

std::vector<CorpusEntry> global_entries() {
  using enum SettingGroup;
  constexpr const char* family = "global light";
  return {
      {family, "large sphere", tiles, [](Canvas c, Random& r) { return sphere_lamp(c, r, 0.5); }},
      {family, "small sphere", tiles, [](Canvas c, Random& r) { return sphere_lamp(c, r, 0.01); }},
      {family, "furnace", noisy_tiles, [](Canvas c, Random& r) { return furnace(c, r, 0.4); }},
      // Fixed samples where a path has tens of rays or seldom finds light: targets would take the most samples.
      {family, "bright furnace", fixed_samples, [](Canvas c, Random& r) { return furnace(c, r, 0.1); }, true, true},
      {family, "furnace of 0.99", fixed_samples, [](Canvas c, Random& r) { return furnace(c, r, 0.01); }, true, true},
      {family, "half of the sky", noisy_tiles, half_sky},
      {family, "colors 10,000 apart", tiles,
       [](Canvas c, Random& r) {
         return sphere_lamp(c, r, 0.5, {0.9, 9e-3, 9e-5});
       }},
      {family, "low lamp", tiles, low_lamp},
      {family, "lamp and its mirror image", noisy_tiles, mirrored_lamp},
      {family, "lamp behind a pane", noisy_tiles, lamp_behind_pane},
      {family, "sky through a hole", noisy_tiles, hole},
      {family, "lamp in a mirror alone", targets, hidden_lamp, true, true},
      {family, "lamp in a mirror alone, fixed samples", fixed_samples, hidden_lamp},
      {family, "81 lamps", tiles, many_lamps},
      {family, "lamp of 800 triangles", tiles, mesh_lamp},
      {family, "lamp in a corner", tiles, corner_light},
      {family, "sun of ten texels", tiles, sunny_sky},
      {family, "leaf", tiles, leaf},
      {family, "integrating sphere", tiles, integrating_sphere},
      {family, "parallel planes", targets, parallel_planes, true, true},
      {family, "room with balls", targets, room, false, true},
  };
}

}  // namespace error_coverage
