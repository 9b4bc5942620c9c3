// Scenes with a closed form: features that few samples hit (specks, thin meshes, texels, emitters behind mirrors, glass
// and slits), ordinary edges, and errors outside of sampling (tone curves with statistics of the image, approximations,
// bounds, files, dilution).
#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "tests/statistics/error_coverage/corpus.h"
#include "tests/support/scenes.h"
#include "tracer/encode.h"

namespace error_coverage {
namespace {

using namespace tracer;
using oracle::Random;
using View = FlatScene::View;

constexpr double half_turn = std::numbers::pi;  // in radians
const Color dark{0.05, 0.07, 0.1}, white{1, 1, 1}, plain{0.3, 0.32, 0.35};

/// `count` squares of `side` pixels, turned by random angles.
CorpusScene squares(Canvas canvas, Random& random, int count, double side, const Color& radiance,
                    View view = View::direct) {
  FlatScene flat(canvas, dark, view);
  for (const Vec2& place : random_places(canvas, random, count, 1.5 * side + 1))
    flat.add(rectangle(place, side, side, random.in(0, half_turn)), radiance);
  return finished(flat);
}

/// An axis-parallel square: the simplest feature that pilots miss.
CorpusScene aligned_square(Canvas canvas, Random& random, double side) {
  FlatScene flat(canvas, dark);
  flat.add(rectangle(random_place(canvas, random, side), side, side), white);
  return finished(flat);
}

/// A square on a ground that changes everywhere a little, so that most pixels have intervals of some width.
CorpusScene square_on_gradient(Canvas canvas, Random& random, double side) {
  FlatScene flat(canvas, {0.1, 0.1, 0.2}, {0.5, 0.6, 0.7});
  flat.add(rectangle(random_place(canvas, random, 2 * side), side, side, random.in(0, half_turn)), white);
  return finished(flat);
}

/// `count` triangles with an area of `area` pixels and an elongation of at most 100.
CorpusScene small_triangles(Canvas canvas, Random& random, int count, double area, const Color& radiance) {
  FlatScene flat(canvas, dark);
  constexpr double elongation_max = 100;
  const double length_max = std::sqrt(2 * area * elongation_max);
  for (const Vec2& place : random_places(canvas, random, count, length_max + 1)) {
    const double length = std::sqrt(2 * area * random.spread(1, elongation_max)), height = 2 * area / length;
    const double angle = random.in(0, 2 * half_turn), c = std::cos(angle), s = std::sin(angle);
    Polygon triangle;
    for (const Vec2 v : {Vec2{-length / 2, 0}, Vec2{length / 2, 0}, Vec2{random.in(-0.5, 0.5) * length, height}})
      triangle.push_back({place.x + c * v.x - s * v.y, place.y + s * v.x + c * v.y});
    flat.add(triangle, radiance);
  }
  return finished(flat);
}

/// Parallel slivers of `width` pixels across the image, 9 pixels apart.
CorpusScene fence(Canvas canvas, Random& random, double width) {
  FlatScene flat(canvas, dark);
  const double start = random.in(0, 9);
  for (double x = -canvas.width / 2.0 + start; x < canvas.width / 2.0; x += 9)
    flat.add(rectangle({x, 0}, width, 0.7 * canvas.height), white);
  return finished(flat);
}

CorpusScene wire(Canvas canvas, Random& random, double width) {
  FlatScene flat(canvas, dark);
  const double angle = random.in(0, half_turn), length = 0.4 * canvas.height;
  const Vec2 place = random_place(canvas, random, 0.3 * canvas.height);
  flat.add_wire({place.x - length * std::cos(angle), place.y - length * std::sin(angle)},
                {place.x + length * std::cos(angle), place.y + length * std::sin(angle)}, width, white);
  return finished(flat);
}

/// One white texel of a black image texture of 256 x 256 texels that covers the canvas; the filter is `nearest`.
CorpusScene bright_texel(Canvas canvas, Random& random) {
  constexpr std::uint32_t side = 256;
  const std::uint32_t column = 32 + random.below(side - 64),
                      row = 64 + random.below(side - 128);  // row 0 at the bottom
  Image texels{side, side, std::vector<float>(3 * side * side)};
  std::fill_n(texels.rgb.begin() + 3 * ((side - 1 - row) * side + column), 3, 1.0F);
  const auto png = encode(texels, Format::png);
  if (!png) throw std::runtime_error(png.error());

  CorpusScene result;
  Scene& scene = result.scene = orthographic_scene(canvas);
  result.assets.bytes = {png->bytes};
  scene.assets = {{"texels.png", "/textures/texels/file"}};
  const double size = canvas.width;  // pixels that the texture covers
  const Texture texture{.pattern = ImageTexture{AssetId{0}, ColorSpace::srgb},
                        .scale = {1 / size, 1 / size},
                        .offset = {0.5, 0.5},
                        .path = {},
                        .filter = Texture::Filter::nearest};
  scene.ambient = {0.9, 0.9, 0.9};
  add_textured_plane(scene, texture).emission = Color{0.1, 0.1, 0.1};

  BoxFilteredImage image(canvas, {.center = {0.1, 0.1, 0.1}});
  const double texel = size / side;
  image.replace(rectangle({(column + 0.5) * texel - size / 2, (row + 0.5) * texel - size / 2}, texel, texel), white);
  result.exact = image.image();
  return result;
}

/// A plane under a directional light at 45 degrees, and occluders of the same material and orientation at this height:
/// only their shadows are visible.
CorpusScene with_shadows(Canvas canvas, const std::vector<Polygon>& shadows, double height) {
  CorpusScene result;
  Scene& scene = result.scene = orthographic_scene(canvas);
  scene.ambient = {0.1, 0.1, 0.1};
  scene.lights.push_back(scenes::directional_light({1, 0, -1}));
  scenes::add(scene, Plane{{0, 0, 0}, {0, 0, 1}, {}}, scenes::matte({0.9, 0.9, 0.9}));
  const double ambient = 0.09, lit = ambient + 0.9 / std::numbers::sqrt2;
  BoxFilteredImage image(canvas, {.center = {lit, lit, lit}});
  for (const Polygon& shadow : shadows) {
    const auto above = [&](std::size_t corner) { return Vec3{shadow[corner].x - height, shadow[corner].y, height}; };
    scenes::add(scene, scenes::quad(above(0), above(1), above(2), above(3)), MaterialId{0});
    image.replace(shadow, {ambient, ambient, ambient});
  }
  result.exact = image.image();
  return result;
}

/// Light through a slit of `width` pixels, which is left of the view.
CorpusScene slit(Canvas canvas, Random& random, double width) {
  const double w = canvas.width, place = random.in(-0.4 * w, 0.4 * w), left = place + 0.7 * w,
               right = 0.7 * w - place - width;
  return with_shadows(
      canvas, {rectangle({place - left / 2, 0}, left, 2 * w), rectangle({place + width + right / 2, 0}, right, 2 * w)},
      2 * w);
}

CorpusScene small_shadow(Canvas canvas, Random& random, double side, Approximations::Shadows shadows) {
  CorpusScene result =
      with_shadows(canvas, {rectangle(random_place(canvas, random, 30), side, side, random.in(0, 1))}, 20);
  result.scene.accuracy.approximate.shadows = shadows;
  return result;
}

/// Shadows of `count` wires of `width` pixels, which are left of the view.
CorpusScene wire_shadows(Canvas canvas, Random& random, int count, double width) {
  std::vector<Polygon> shadows;
  for (const Vec2& place : random_places(canvas, random, count, 8))
    shadows.push_back(rectangle({place.x, 0}, width, 0.8 * canvas.height));
  return with_shadows(canvas, shadows, 2.0 * canvas.width);
}

/// Many edges in one corner, none elsewhere.
CorpusScene busy_corner(Canvas canvas, Random& random) {
  FlatScene flat(canvas, plain);
  for (int row = 0; row < 12; ++row)
    for (int column = 0; column < 12; ++column)
      if (random.chance(0.7))
        flat.add(rectangle({4.0 * column - canvas.width / 2.0 + 9, 4.0 * row - canvas.height / 2.0 + 9}, 2.5, 2.5,
                           random.in(0, half_turn)),
                 random.color());
  return finished(flat);
}

CorpusScene half_plane(Canvas canvas, Random& random) {
  FlatScene flat(canvas, {0.1, 0.15, 0.3});
  const double angle = random.in(0, 2 * half_turn);
  flat.add(half_plane_from(canvas, random_place(canvas, random, 0.3 * canvas.height), angle), {0.8, 0.7, 0.5});
  return finished(flat);
}

CorpusScene shapes_on_gradient(Canvas canvas, Random& random) {
  FlatScene flat(canvas, {0.1, 0.1, 0.2}, {0.5, 0.6, 0.7});
  for (const Vec2& place : random_places(canvas, random, 12, 28)) {
    if (random.chance(0.5)) {
      flat.add(disc(place, random.in(5, 13)), random.color());
    } else {
      flat.add(rectangle(place, random.in(6, 18), random.in(6, 18), random.in(0, half_turn)), random.color());
    }
  }
  return finished(flat);
}

CorpusScene checker_of(Canvas canvas, Random& random, double cell) {
  const Vec2 offset{random.in(0, 2), random.in(0, 2)};
  const Color even{0.1, 0.1, 0.1}, odd{0.8, 0.75, 0.6};
  CorpusScene result;
  result.scene = orthographic_scene(canvas);
  Texture texture{CheckerTexture{{even, odd}}, {1 / cell, 1 / cell}, offset, {}};
  texture.filter = random.chance(0.5) ? Texture::Filter::mipmap : Texture::Filter::nearest;
  result.scene.ambient = {1, 1, 1};
  add_textured_plane(result.scene, texture);
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

/// Hot squares before a gradient with some ordinary edges.
CorpusScene hot_squares(Canvas canvas, Random& random, double side, double radiance, const Output& output) {
  FlatScene flat(canvas, {0.1, 0.1, 0.15}, {0.6, 0.55, 0.5});
  int number = 0;
  for (const Vec2& place : random_places(canvas, random, 8, 24)) {
    const bool hot = number++ < 2;
    const double size = hot ? side : 12;
    const Color color = hot ? Color{radiance, radiance, radiance} : Color{0.8, 0.4, 0.1};
    flat.add(rectangle(place, size, size, random.in(0, half_turn)), color);
  }
  flat.scene().output = output;
  return finished(flat);
}

/// Two infinite mirrors that emit; every path is infinite, and the image has two radiances, divided by the horizon.
CorpusScene mirror_hall(Canvas canvas, Random& random, double reflection) {
  const double roll = random.in(-0.6, 0.6), floor = 0.2 * (1 - reflection), ceiling = 2 * floor;
  CorpusScene result;
  Scene& scene = result.scene;
  scene.image = {canvas.width, canvas.height};
  scene.accuracy.max_depth = 64;
  scene.accuracy.cutoff = 1e-3;
  scene.camera = {{0, 3, 0}, {1, 3, 0}, {0, std::cos(roll), std::sin(roll)}, 40};
  for (const auto& [height, emission] : {std::pair{0.0, floor}, std::pair{6.0, ceiling}}) {
    Material wall = scenes::mirror(reflection);
    wall.emission = Color{emission, emission, emission};
    scenes::add(scene, Plane{{0, height, 0}, {0, 1, 0}, {}}, wall);
  }
  const double series = 1 / (1 - reflection * reflection);
  const double below = series * (floor + reflection * ceiling), above = series * (ceiling + reflection * floor);
  BoxFilteredImage image(canvas, {.center = {below, below, below}});
  image.replace(half_plane_from(canvas, {}, roll), {above, above, above});
  result.exact = image.image();
  return result;
}

/// Edges of all directions between saturated colors, before a gradient: hard for block codecs and palettes.
CorpusScene colored_discs(Canvas canvas, Random& random) {
  FlatScene flat(canvas, {0.02, 0.1, 0.3}, {0.7, 0.8, 0.9});
  for (const Vec2& place : random_places(canvas, random, static_cast<int>(canvas.width / 12), 17))
    flat.add(disc(place, random.in(3, 8)), random.color());
  return finished(flat);
}

/// A wheel of sectors with a radius of 40 pixels on any canvas, so that a larger canvas has the same error in fewer
/// of its pixels.
CorpusScene wheel(Canvas canvas, Random& random, std::uint32_t canvas_factor) {
  const Canvas large{canvas.width * canvas_factor, canvas.height * canvas_factor};
  FlatScene flat(large, plain);
  const Vec2 center = random_place(large, random, 50);
  constexpr int sectors = 40;
  for (int i = 0; i < sectors; ++i) {
    const double from = (i + random.in(0, 0.1)) * 2 * half_turn / sectors, to = from + half_turn / sectors;
    flat.add({{center.x, center.y},
              {center.x + 40 * std::cos(from), center.y + 40 * std::sin(from)},
              {center.x + 40 * std::cos(to), center.y + 40 * std::sin(to)}},
             {0.9, 0.85, 0.2});
  }
  return finished(flat);
}

}  // namespace

std::vector<CorpusEntry> flat_entries() {
  using enum SettingGroup;
  using Overflow = Output::Overflow;
  using Shadows = Approximations::Shadows;
  const Color dim{0.2, 0.22, 0.25}, hot{20, 20, 20};
  const Output scale{.overflow = Overflow::scale}, reinhard{.overflow = Overflow::reinhard}, bright{.exposure = 2};
  const auto of = [](auto function, auto... arguments) {
    return [=](Canvas canvas, Random& random) { return function(canvas, random, arguments...); };
  };
  return {
      {"bright specks", "square of 6 pixels", budgets, of(aligned_square, 6.0)},
      {"bright specks", "square of 2.5 pixels", targets, of(aligned_square, 2.5)},
      {"bright specks", "square of 1 pixel", targets, of(aligned_square, 1.0)},
      {"bright specks", "square of 4 pixels on a gradient", targets, of(square_on_gradient, 4.0)},
      {"bright specks", "hot square of 0.3 pixels", budgets, of(squares, 1, 0.3, hot, View::direct)},
      {"bright specks", "six squares of 3 pixels", targets, of(squares, 6, 3.0, white, View::direct)},
      {"repeated validation", "10 squares of 0.8 pixels", targets, of(squares, 10, 0.8, white, View::direct)},
      {"repeated validation", "40 squares of 0.5 pixels", budgets, of(squares, 40, 0.5, white, View::direct)},
      {"repeated validation", "12 hot squares of 0.2 pixels", targets, of(squares, 12, 0.2, hot, View::direct)},
      {"thin meshes", "200 faint triangles of 0.04 pixels", budgets, of(small_triangles, 200, 0.04, dim)},
      {"thin meshes", "200 white triangles of 0.04 pixels", targets, of(small_triangles, 200, 0.04, white)},
      {"thin meshes", "60 white triangles of 0.3 pixels", targets, of(small_triangles, 60, 0.3, white)},
      {"thin meshes", "fence of 0.05 pixels", targets, of(fence, 0.05)},
      {"hidden features", "bright texel", targets, bright_texel},
      {"hidden features", "emitters in a mirror", budgets, of(squares, 5, 2.0, white, View::mirror)},
      {"hidden features", "emitters behind glass", targets, of(squares, 5, 2.0, white, View::glass)},
      {"hidden features", "light through a slit of 0.1 pixels", targets, of(slit, 0.1)},
      {"hidden features", "wire of 0.03 pixels", targets, of(wire, 0.03)},
      {"hidden features", "60 squares of 0.5 pixels in a mirror", targets, of(squares, 60, 0.5, white, View::mirror)},
      {"shadows from outside", "wire of 0.1 pixels", targets, of(wire_shadows, 1, 0.1)},
      {"shadows from outside", "10 wires of 0.4 pixels", targets, of(wire_shadows, 10, 0.4)},
      {"fixed samples", "10 squares of 0.8 pixels", fixed_samples, of(squares, 10, 0.8, white, View::direct)},
      {"fixed samples", "a square of 0.5 pixels in a mirror", fixed_samples, of(squares, 1, 0.5, white, View::mirror)},
      {"fixed samples", "200 faint triangles of 0.04 pixels", fixed_samples, of(small_triangles, 200, 0.04, dim)},
      {"fixed samples", "fence of 0.3 pixels", fixed_samples, of(fence, 0.3)},
      {"fixed samples", "half plane", fixed_samples, half_plane},
      {"fixed samples", "shapes on a gradient", fixed_samples, shapes_on_gradient},
      {"fixed samples", "checker", fixed_samples, checker},
      {"fixed samples", "checker of holes", fixed_samples, checker_of_holes},
      {"ordinary, closed form", "half plane", budgets, half_plane},
      {"ordinary, closed form", "shapes on a gradient", budgets, shapes_on_gradient},
      {"ordinary, closed form", "checker", targets, checker},
      {"image statistics", "scale, hot squares of 0.7 pixels", targets, of(hot_squares, 0.7, 8.0, scale)},
      {"image statistics", "scale, hot squares of 0.3 pixels", targets, of(hot_squares, 0.3, 40.0, scale)},
      {"image statistics", "scale, hot squares of 12 pixels", budgets, of(hot_squares, 12.0, 8.0, scale)},
      {"image statistics", "reinhard, hot squares of 0.7 pixels", targets, of(hot_squares, 0.7, 8.0, reinhard)},
      {"image statistics", "exposure 2, squares of 0.7 pixels", targets, of(hot_squares, 0.7, 4.0, bright)},
      {"approximations", "shadows none, shadow of 4 pixels", targets, of(small_shadow, 4.0, Shadows::none)},
      {"approximations", "shadows none, shadow of 12 pixels", targets, of(small_shadow, 12.0, Shadows::none)},
      {"approximations", "shadows map, shadow of 12 pixels", targets, of(small_shadow, 12.0, Shadows::map)},
      {"path bounds", "hall of mirrors of 0.95", bounds, of(mirror_hall, 0.95)},
      {"path bounds", "hall of mirrors of 0.8", bounds, of(mirror_hall, 0.8)},
      {"encoding", "colored discs", files, colored_discs},
      {"dilution", "busy corner", tiles, busy_corner},
      {"dilution", "wheel", tiles, of(wheel, 1U)},
      {"dilution", "wheel on four times the canvas", tiles, of(wheel, 2U)},
  };
}

/// The entry of this name with an image that is divided by its brightest channel.
static CorpusEntry scaled(const std::vector<CorpusEntry>& entries, const std::string& name) {
  CorpusEntry entry = *std::ranges::find(entries, name, &CorpusEntry::name);
  entry.family = "image statistics";
  entry.name = "scale, " + name;
  entry.settings = SettingGroup::budgets;
  entry.build = [build = entry.build](Canvas canvas, Random& random) {
    CorpusScene scene = build(canvas, random);
    scene.scene.output = {.exposure = 3, .overflow = Output::Overflow::scale};
    return scene;
  };
  return entry;
}

std::vector<CorpusEntry> corpus() {
  std::vector<CorpusEntry> all = flat_entries();
  for (const auto& entries : {sampled_entries(), random_entries(), global_entries()})
    all.insert(all.end(), entries.begin(), entries.end());
  for (const char* name : {"checker", "penumbra", "large sphere"}) all.push_back(scaled(all, name));
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
