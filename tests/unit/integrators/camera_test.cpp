// Camera rays beside the geometry of pinhole, window, globe and lens in long double.
#include <gtest/gtest.h>

#include <numbers>
#include <optional>

#include "tests/support/chi_square.h"
#include "tests/support/effort.h"
#include "tests/support/random.h"
#include "tracer/src/cameras/compiled_camera.h"

namespace tracer {
namespace {

using oracle::Random;
using oracle::Real;
using oracle::Vec;

/// In the world's own frame.
RenderSpace world_frame() {
  FiniteBounds bounds;
  bounds.include(Vec3{0, 0, 0});
  return RenderSpace(bounds);
}

CompiledCamera trace_camera(const Camera& camera, std::uint32_t width, std::uint32_t height) {
  return {camera, {width, height}, world_frame()};
}

void expect_near(const Vec3& actual, const Vec& expected, double tolerance) {
  EXPECT_NEAR(actual.x, static_cast<double>(expected.x), tolerance);
  EXPECT_NEAR(actual.y, static_cast<double>(expected.y), tolerance);
  EXPECT_NEAR(actual.z, static_cast<double>(expected.z), tolerance);
}

constexpr Camera::Type types[] = {Camera::Type::perspective, Camera::Type::orthographic, Camera::Type::panorama};

struct View {
  Camera camera;
  Vec forward, right, up;
  std::uint32_t width = 0, height = 0;
};

/// Nothing where `up` is too near the view.
std::optional<View> random_view(Random& random, Camera::Type type, double scale = 5) {
  View view;
  view.width = 1 + random.below(2000);
  view.height = 1 + random.below(2000);
  view.camera = {random.vector(scale), random.vector(scale), random.vector(2), random.in(0.001, 179.9), type};
  view.camera.height = random.spread(0.002, 20) * scale;
  view.forward = unit(Vec(view.camera.look_at) - Vec(view.camera.position));
  const Vec sideways = cross(view.forward, unit(view.camera.up));
  if (length(sideways) < 1e-2L) return std::nullopt;
  view.right = unit(sideways);
  view.up = cross(view.right, view.forward);
  return view;
}

struct ExpectedRay {
  Vec origin, direction;
};

/// The ray through a position of the image: from a pinhole, from a window, or by longitude and latitude.
ExpectedRay expected_ray(const View& view, double x, double y) {
  constexpr Real pi = std::numbers::pi_v<Real>;
  const auto& [camera, forward, right, up, width, height] = view;
  const Vec position = camera.position;
  const Real across = x - width / 2.0L, above = height / 2.0L - y;  // of the center, in pixels
  const Vec offset = across * right + above * up;
  if (camera.type == Camera::Type::orthographic) return {position + (camera.height / Real(height)) * offset, forward};
  if (camera.type == Camera::Type::perspective)
    return {position, unit(forward + (2 * std::tan(camera.fov_deg / 360 * pi) / height) * offset)};
  const Real longitude = 2 * pi * across / width, latitude = pi * above / height;
  return {position, (std::cos(latitude) * std::cos(longitude)) * forward +
                        (std::cos(latitude) * std::sin(longitude)) * right + std::sin(latitude) * up};
}

TEST(Camera, HasTheRaysOfItsTypeForRandomViews) {
  Random random(1);
  for (const auto type : types)
    for (std::uint64_t i = 0; i < effort::cases(4000); ++i) {
      const double scale = random.spread(1e-50, 1e50);
      const auto view = random_view(random, type, scale);
      if (!view) continue;
      const auto camera = trace_camera(view->camera, view->width, view->height);
      const double x = random.in(0, view->width), y = random.in(0, view->height);
      const ExpectedRay expected = expected_ray(*view, x, y);
      const auto ray = camera.generate_ray(x, y);
      const bool moves = type == Camera::Type::orthographic, turns = type == Camera::Type::panorama;
      expect_near(ray.origin, expected.origin, moves ? 1e-12 * (scale + view->camera.height * view->width) : 0);
      expect_near(ray.direction, expected.direction, 1e-13);
      EXPECT_NEAR(static_cast<double>(length(Vec(ray.direction))), 1, 4e-16);
      const Vec axis = turns ? expected.direction : view->forward;
      EXPECT_NEAR(camera.depth(ray.direction, 3), static_cast<double>(3 * dot(expected.direction, axis)), 1e-12);
      if (HasFailure()) FAIL() << "type " << static_cast<int>(type);
    }
}

TEST(Lens, KeepsWhatIsInFocusSharpAndItsCentreIsThePinhole) {
  Random random(4);
  for (const auto type : types) {
    for (std::uint64_t i = 0; i < effort::cases(1000); ++i) {
      auto view = random_view(random, type);
      if (!view) continue;
      view->camera.aperture = random.in(0.01, 2);
      view->camera.focus_distance = random.in(0.5, 20);
      const auto camera = trace_camera(view->camera, view->width, view->height);
      const double x = random.in(0, view->width), y = random.in(0, view->height);
      const auto pinhole = camera.generate_ray(x, y);
      const Real axial = type == Camera::Type::panorama ? 1 : dot(Vec(pinhole.direction), view->forward);
      const Vec focus = Vec(pinhole.origin) + (*view->camera.focus_distance / axial) * Vec(pinhole.direction);
      const auto generate_ray = camera.generate_ray(x, y, {random.in(0, 1), random.in(0, 1)});
      const Vec offset = Vec(generate_ray.origin) - Vec(pinhole.origin);
      EXPECT_LE(static_cast<double>(length(offset)), view->camera.aperture / 2 * (1 + 1e-12) + 1e-12);
      const Vec axis = type == Camera::Type::panorama ? Vec(pinhole.direction) : view->forward;
      EXPECT_NEAR(static_cast<double>(dot(offset, axis)), 0, 1e-12) << "the lens faces along the axis";
      const Vec to_focus = focus - Vec(generate_ray.origin);
      const Vec missed = to_focus - dot(to_focus, Vec(generate_ray.direction)) * Vec(generate_ray.direction);
      EXPECT_NEAR(static_cast<double>(length(missed) / length(to_focus)), 0, 1e-12);
      const auto centre = camera.generate_ray(x, y, {0.5, 0.5});
      expect_near(centre.origin, Vec(pinhole.origin), 0);
      expect_near(centre.direction, Vec(pinhole.direction), 1e-14);
      if (HasFailure()) return;
    }
  }
}

TEST(Lens, IsSampledUniformly) {
  Camera c{{0, 0, 0}, {0, 0, -1}, {0, 1, 0}, 60};
  c.aperture = 2;
  const auto camera = trace_camera(c, 9, 9);
  const auto on_hemisphere = [&](const Vec2& xi) {  // of the same area (Lambert 1772)
    const Vec3 at = camera.generate_ray(2, 3, xi).origin;
    const double squared = dot(at, at), scale = std::sqrt(2 - squared);
    return Vec3{at.x * scale, at.y * scale, 1 - squared};
  };
  statistics::expect_distribution(
      on_hemisphere, [](const Vec3&) { return 0.5 / std::numbers::pi; }, {0, 0, 1}, 0);
}

TEST(Lens, FocusesOnLookAtByDefault) {
  Camera c{{0, 0, 5}, {0, 0, 1}, {0, 1, 0}, 60};
  c.aperture = 1;
  Camera given = c;
  given.focus_distance = 4;
  EXPECT_EQ(trace_camera(c, 9, 9).generate_ray(2, 3, {0.1, 0.9}).direction,
            trace_camera(given, 9, 9).generate_ray(2, 3, {0.1, 0.9}).direction);
}

TEST(Lens, SpreadsAPointOutOfFocusOverTheCircleOfConfusionOfSimilarTriangles) {
  // Focus at 2, a wall at 5: rays of one image position meet it within aperture (5 - 2) / 2 of each other.
  Camera c{{0, 0, 0}, {0, 0, -1}, {0, 1, 0}, 60};
  c.aperture = 0.5;
  c.focus_distance = 2;
  const auto camera = trace_camera(c, 100, 100);
  const Vec3 through = camera.generate_ray(30, 80).direction;
  const Vec middle = (5 / -Real{through.z}) * Vec(through);
  Real widest = 0, area_mean = 0;
  constexpr int side = 100;
  for (int i = 0; i < side * side; ++i) {
    const int column = i % side, row = i / side;
    const auto generate_ray = camera.generate_ray(30, 80, {(column + 0.5) / side, (row + 0.5) / side});
    const Vec at = Vec(generate_ray.origin) + (5 / -Real{generate_ray.direction.z}) * Vec(generate_ray.direction);
    const Real radius = length(at - middle);
    widest = std::max(widest, radius);
    area_mean += radius * radius / (side * side);
  }
  const double radius = 0.25 * 3 / 2;
  EXPECT_LE(static_cast<double>(widest), radius * (1 + 1e-12));
  EXPECT_GT(static_cast<double>(widest), radius * 0.98);
  EXPECT_NEAR(static_cast<double>(area_mean), radius * radius / 2, 1e-3 * radius * radius) << "uniform over the disc";
}

TEST(Camera, AimsManyRaysAsItAimsEach) {
  for (const auto type : types) {
    Camera described;
    described.type = type;
    described.position = {1, 2, 3};
    described.look_at = {-4, 1, 0.5};
    const CompiledCamera camera(described, {}, RenderSpace(FiniteBounds{{{-1, -1, -1}, {2, 3, 4}}}));
    constexpr std::size_t count = 37;  // no multiple of what vectors hold
    oracle::Random random(5);
    double x[count], y[count], rays[6][count];
    for (std::size_t i = 0; i < count; ++i) {
      x[i] = random.in(0, 640);
      y[i] = random.in(0, 480);
    }
    camera.generate_rays(x, y, count, {rays[0], rays[1], rays[2], rays[3], rays[4], rays[5]});
    for (std::size_t i = 0; i < count; ++i) {
      const CompiledCamera::CameraRay generate_ray = camera.generate_ray(x[i], y[i]);
      EXPECT_EQ((Vec3{rays[0][i], rays[1][i], rays[2][i]}), generate_ray.origin);
      EXPECT_EQ((Vec3{rays[3][i], rays[4][i], rays[5][i]}), generate_ray.direction);
    }
  }
}

}  // namespace
}  // namespace tracer
