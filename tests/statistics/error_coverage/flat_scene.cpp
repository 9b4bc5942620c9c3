#include "tests/statistics/error_coverage/flat_scene.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/support/scenes.h"
#include "tracer/src/math/vec.h"

namespace error_coverage {

using namespace tracer;

namespace {

constexpr double mirror_factor = 0.9, glass_factor = 0.81;

/// The part of `polygon` where `side` x + `up` y <= limit.
Polygon clipped(const Polygon& polygon, double side, double up, double limit) {
  Polygon result;
  const auto distance = [&](const Vec2& p) { return side * p.x + up * p.y - limit; };
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vec2 &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
    const double da = distance(a), db = distance(b);
    if (da <= 0) result.push_back(a);
    if ((da < 0 && db > 0) || (da > 0 && db < 0)) {
      const double t = da / (da - db);
      result.push_back({a.x + t * (b.x - a.x), a.y + t * (b.y - a.y)});
    }
  }
  return result;
}

/// Area and centroid; coordinates relative to the first vertex avoid cancellation.
std::pair<double, Vec2> area_and_centroid(const Polygon& polygon) {
  double area = 0;
  Vec2 moment{};
  for (std::size_t i = 1; i + 1 < polygon.size(); ++i) {
    const Vec2 a{polygon[i].x - polygon[0].x, polygon[i].y - polygon[0].y};
    const Vec2 b{polygon[i + 1].x - polygon[0].x, polygon[i + 1].y - polygon[0].y};
    const double part = (a.x * b.y - a.y * b.x) / 2;
    area += part;
    moment = {moment.x + part * (a.x + b.x) / 3, moment.y + part * (a.y + b.y) / 3};
  }
  if (area <= 0) return {0, {}};
  return {area, {polygon[0].x + moment.x / area, polygon[0].y + moment.y / area}};
}

/// Integral from 0 to x of the square wave that is 1 on [0, 1) and -1 on [1, 2).
double square_wave_integral(double x) {
  const double phase = x - 2 * std::floor(x / 2);
  return phase < 1 ? phase : 2 - phase;
}

}  // namespace

Polygon rectangle(const Vec2& center, double width, double height, double angle) {
  const double c = std::cos(angle), s = std::sin(angle);
  Polygon polygon;
  for (const Vec2 corner : {Vec2{-1, -1}, Vec2{1, -1}, Vec2{1, 1}, Vec2{-1, 1}}) {
    const double x = corner.x * width / 2, y = corner.y * height / 2;
    polygon.push_back({center.x + c * x - s * y, center.y + s * x + c * y});
  }
  return polygon;
}

Polygon disc(const Vec2& center, double radius, int corners) {
  const double step = 2 * std::numbers::pi / corners, outer = radius * std::sqrt(step / std::sin(step));
  Polygon polygon;
  for (int i = 0; i < corners; ++i)
    polygon.push_back({center.x + outer * std::cos(i * step), center.y + outer * std::sin(i * step)});
  return polygon;
}

Polygon half_plane_from(Canvas canvas, const Vec2& place, double angle) {
  const double reach = canvas.width + canvas.height;
  return rectangle({place.x - reach * std::sin(angle), place.y + reach * std::cos(angle)}, 2 * reach, 2 * reach, angle);
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

Color LinearRadiance::at(const Vec2& position) const { return center + along_y * position.y; }

BoxFilteredImage::BoxFilteredImage(Canvas canvas, const LinearRadiance& ground)
    : canvas_(canvas), ground_(ground), rgb_(3 * std::size_t{canvas.width} * canvas.height) {
  for (std::uint32_t y = 0; y < canvas.height; ++y)
    for (std::uint32_t x = 0; x < canvas.width; ++x)
      add(x, y, ground_.at({x + 0.5 - canvas.width / 2.0, canvas.height / 2.0 - y - 0.5}), 1);
}

void BoxFilteredImage::add(std::uint32_t x, std::uint32_t y, const Color& radiance, double weight) {
  double* const pixel = rgb_.data() + 3 * (std::size_t{y} * canvas_.width + x);
  pixel[0] += weight * radiance.r;
  pixel[1] += weight * radiance.g;
  pixel[2] += weight * radiance.b;
}

void BoxFilteredImage::replace(const Polygon& polygon, const Color& radiance) {
  const double left = canvas_.width / 2.0, top = canvas_.height / 2.0;
  const auto [x0, x1] = std::minmax_element(polygon.begin(), polygon.end(), [](auto& a, auto& b) { return a.x < b.x; });
  const auto [y0, y1] = std::minmax_element(polygon.begin(), polygon.end(), [](auto& a, auto& b) { return a.y < b.y; });
  const auto index = [](double position, std::uint32_t size) {
    return static_cast<std::uint32_t>(std::clamp(std::floor(position), 0.0, static_cast<double>(size)));
  };
  const std::uint32_t columns_end = index(x1->x + left + 1, canvas_.width);
  const std::uint32_t rows_end = index(top - y0->y + 1, canvas_.height);
  for (std::uint32_t y = index(top - y1->y, canvas_.height); y < rows_end; ++y) {
    const Polygon row = clipped(clipped(polygon, 0, 1, top - y), 0, -1, -(top - y - 1));
    for (std::uint32_t x = index(x0->x + left, canvas_.width); x < columns_end; ++x) {
      const auto [share, centroid] = area_and_centroid(clipped(clipped(row, 1, 0, x + 1 - left), -1, 0, -(x - left)));
      add(x, y, radiance, share);
      add(x, y, ground_.at(centroid), -share);
    }
  }
}

Image BoxFilteredImage::image(double factor) const {
  Image image{canvas_.width, canvas_.height, std::vector<float>(rgb_.size())};
  std::transform(rgb_.begin(), rgb_.end(), image.rgb.begin(),
                 [&](double value) { return static_cast<float>(std::max(0.0, factor * value)); });
  return image;
}

Scene orthographic_scene(Canvas canvas) {
  Scene scene;
  scene.image = {canvas.width, canvas.height};
  scene.camera = scenes::orthographic({0, 0, 8.0 * canvas.width}, {}, canvas.height);
  return scene;
}

Material& add_textured_plane(Scene& scene, const Texture& texture, double z) {
  scene.textures.push_back(texture);
  Material material = scenes::matte({});
  material.color = TextureId{0};
  scenes::add(scene, Plane{{0, 0, z}, {0, 0, 1}, Vec3{1, 0, 0}}, material);
  return scene.materials.back();
}

FlatScene::FlatScene(Canvas canvas, const Color& ground, View view)
    : canvas_(canvas), view_(view), scene_(orthographic_scene(canvas)), image_(canvas, {.center = ground}) {
  scene_.background.color = ground;
  if (view == View::mirror) {
    factor_ = mirror_factor;
    scenes::add(scene_, Plane{{0, 0, 0}, {0, 1, 1}, {}}, scenes::mirror(mirror_factor));
  } else if (view == View::glass) {
    factor_ = glass_factor;
    Material pane = scenes::matte({0, 0, 0});
    pane.transmission = 0.9;
    const double side = 2.0 * (canvas.width + canvas.height);
    scenes::add(scene_, Box{{-side, -side, 50}, {side, side, 60}}, pane);
  }
}

FlatScene::FlatScene(Canvas canvas, const Color& bottom, const Color& top)
    : canvas_(canvas),
      scene_(orthographic_scene(canvas)),
      image_(canvas, {.center = (bottom + top) * 0.5, .along_y = (top + bottom * -1) * (1.0 / canvas.height)}) {
  scene_.ambient = {1, 1, 1};
  const Vec2 scale{1, 1.0 / canvas.height};
  add_textured_plane(scene_, {GradientTexture{{bottom, top}}, scale, {0, 0.5}, {}, Texture::Wrap::clamp}, -1);
}

Vec3 FlatScene::world(const Vec2& position) const {
  // The mirror at z = -y reflects the camera's rays upwards, to the plane y = const.
  if (view_ == View::mirror) return {position.x, 10.0 * canvas_.height, -position.y};
  return {position.x, position.y, 0};
}

void FlatScene::add(const Polygon& polygon, const Color& radiance) {
  Mesh mesh;
  for (const Vec2& vertex : polygon) mesh.positions.push_back(world(vertex));
  for (std::uint32_t i = 1; i + 1 < polygon.size(); ++i) mesh.triangles.push_back({0, i, i + 1});
  scenes::add(scene_, mesh, scenes::glowing(radiance));
  image_.replace(polygon, radiance);
}

void FlatScene::add_wire(const Vec2& from, const Vec2& to, double width, const Color& radiance) {
  scenes::add(scene_, Cylinder{world(from), world(to), width / 2, false, {}}, scenes::glowing(radiance));
  const double dx = to.x - from.x, dy = to.y - from.y;
  image_.replace(rectangle({(from.x + to.x) / 2, (from.y + to.y) / 2}, std::hypot(dx, dy), width, std::atan2(dy, dx)),
                 radiance);
}

Image checker_image(Canvas canvas, double cell, const Vec2& offset, const Color& even, const Color& odd) {
  const auto mean = [&](double begin, double shift) {  // of the square wave over [begin, begin + 1] pixels
    return cell * (square_wave_integral((begin + 1) / cell + shift) - square_wave_integral(begin / cell + shift));
  };
  return image_of(canvas, [&](double x, double y) {
    const double product = mean(x - 0.5, offset.x) * mean(y - 0.5, offset.y);
    return even * ((1 + product) / 2) + odd * ((1 - product) / 2);
  });
}

}  // namespace error_coverage
