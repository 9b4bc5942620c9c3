// Features that few samples hit: specks, thin meshes, texels, and emitters behind mirrors, glass and slits.
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

const Color dark{0.05, 0.07, 0.1}, white{1, 1, 1};

/// `count` squares of `side` pixels, turned by random angles.
CorpusScene squares(Canvas canvas, Random& random, int count, double side, const Color& radiance,
                    View view = View::direct) {
  FlatScene flat(canvas, dark, view);
  for (const Vec2& place : random_places(canvas, random, count, 1.5 * side + 1))
    flat.add(rectangle(place, side, side, random.in(0, std::numbers::pi)), radiance);
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
  flat.add(rectangle(random_place(canvas, random, 2 * side), side, side, random.in(0, std::numbers::pi)), white);
  return finished(flat);
}

/// `count` triangles with an area of `area` pixels and an elongation of at most 100.
CorpusScene small_triangles(Canvas canvas, Random& random, int count, double area, const Color& radiance) {
  FlatScene flat(canvas, dark);
  constexpr double elongation_max = 100;
  const double length_max = std::sqrt(2 * area * elongation_max);
  for (const Vec2& place : random_places(canvas, random, count, length_max + 1)) {
    const double length = std::sqrt(2 * area * random.spread(1, elongation_max)), height = 2 * area / length;
    const double angle = random.in(0, 2 * std::numbers::pi), c = std::cos(angle), s = std::sin(angle);
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
  const double angle = random.in(0, std::numbers::pi), length = 0.4 * canvas.height;
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
  Texture texture;
  texture.pattern = ImageTexture{AssetId{0}, ColorSpace::srgb};
  const double size = canvas.width;  // pixels that the texture covers
  texture.scale = {1 / size, 1 / size};
  texture.offset = {0.5, 0.5};
  texture.filter = Texture::Filter::nearest;
  scene.textures.push_back(texture);
  scene.ambient = {0.9, 0.9, 0.9};
  Material material = scenes::glowing({0.1, 0.1, 0.1});
  material.color = TextureId{0};
  scenes::add(scene, Plane{{0, 0, 0}, {0, 0, 1}, Vec3{1, 0, 0}}, material);

  BoxFilteredImage image(canvas, {.center = {0.1, 0.1, 0.1}});
  const double texel = size / side;
  image.replace(rectangle({(column + 0.5) * texel - size / 2, (row + 0.5) * texel - size / 2}, texel, texel), white);
  result.exact = image.image();
  return result;
}

/// A plane lit by a directional light at 45 degrees through a slit of `width` pixels, which is left of the view.
CorpusScene slit(Canvas canvas, Random& random, double width) {
  const double w = canvas.width, height = 2 * w, place = random.in(-0.4 * w, 0.4 * w);
  CorpusScene result;
  Scene& scene = result.scene = orthographic_scene(canvas);
  scene.ambient = {0.1, 0.1, 0.1};
  scene.lights.push_back(scenes::directional_light({1, 0, -1}));
  scenes::add(scene, Plane{{0, 0, 0}, {0, 0, 1}, {}}, scenes::matte({0.9, 0.9, 0.9}));
  for (const auto& [from, to] : {std::pair{-0.7 * w, place}, std::pair{place + width, 0.7 * w}}) {
    Mesh blocker;
    for (const Vec2 corner : {Vec2{from, -w}, Vec2{to, -w}, Vec2{to, w}, Vec2{from, w}})
      blocker.positions.push_back({corner.x - height, corner.y, height});
    blocker.triangles = {{0, 1, 2}, {0, 2, 3}};
    scenes::add(scene, blocker, MaterialId{0});
  }
  const double ambient = 0.09, lit = ambient + 0.9 / std::numbers::sqrt2;
  BoxFilteredImage image(canvas, {.center = {ambient, ambient, ambient}});
  image.replace(rectangle({place + width / 2, 0}, width, 2 * w), {lit, lit, lit});
  result.exact = image.image();
  return result;
}

}  // namespace

std::vector<CorpusEntry> feature_entries() {
  using enum SettingGroup;
  const Color dim{0.2, 0.22, 0.25}, hot{20, 20, 20};
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
      {"fixed samples", "10 squares of 0.8 pixels", fixed_samples, of(squares, 10, 0.8, white, View::direct)},
      {"fixed samples", "a square of 0.5 pixels in a mirror", fixed_samples, of(squares, 1, 0.5, white, View::mirror)},
      {"fixed samples", "200 faint triangles of 0.04 pixels", fixed_samples, of(small_triangles, 200, 0.04, dim)},
      {"fixed samples", "fence of 0.3 pixels", fixed_samples, of(fence, 0.3)},
  };
}

}  // namespace error_coverage
