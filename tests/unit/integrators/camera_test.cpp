// Camera rays beside the geometry of pinhole, window, globe and lens in long double.
#include <gtest/gtest.h>

#include <numbers>
#include <optional>

#include "tests/support/effort.h"
#include "tests/support/random.h"
#include "tracer/src/cameras/compiled_camera.h"
#include "tracer/src/math/sampling.h"

namespace tracer {
namespace {

using oracle::Random;
using oracle::Real;
using oracle::Vec;

/// In the world's own frame.
RenderSpace world_frame() {
  FiniteBounds bounds;
  bounds.include({0, 0, 0});
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

TEST(PerspectiveCamera, RaysAreThePinholesForRandomViews) {
  Random random(1);
  for (std::uint64_t i = 0; i < effort::cases(5000); ++i) {
    const double scale = random.spread(1e-50, 1e50);
    Camera c{random.vector(scale), random.vector(scale), random.vector(random.spread(1e-50, 1e50)),
             random.in(0.001, 179.9)};
    const std::uint32_t width = 1 + random.below(2000), height = 1 + random.below(2000);
    const auto camera = trace_camera(c, width, height);
    const Vec forward = unit(Vec(c.look_at) - Vec(c.position));
    const Vec sideways = cross(forward, unit(c.up));
    if (length(sideways) < 1e-3L) continue;
    const Vec right = unit(sideways), up = cross(right, forward);
    const Real pixel = 2 * std::tan(c.fov_deg / 360 * std::numbers::pi_v<Real>) / height;
    const double x = random.in(0, width), y = random.in(0, height);
    const Vec expected = unit(forward + (pixel * (x - width / 2.0L)) * right + (pixel * (height / 2.0L - y)) * up);
    const Vec3 direction = camera.generate_ray(x, y).direction;
    expect_near(direction, expected, 1e-12);
    EXPECT_NEAR(static_cast<double>(length(Vec(direction))), 1, 4e-16);
    if (HasFailure()) return;
  }
}

struct View {
  Camera camera;
  Vec forward, right, up;
  std::uint32_t width, height;
};

/// Nothing where `up` is too near the view.
std::optional<View> random_view(Random& random, Camera::Type type) {
  View view{.camera = {random.vector(5), random.vector(5), random.vector(2), random.in(5, 120)},
            .forward = {},
            .right = {},
            .up = {},
            .width = 1 + random.below(500),
            .height = 1 + random.below(500)};
  view.camera.type = type;
  view.camera.height = random.spread(0.01, 100);
  view.forward = unit(Vec(view.camera.look_at) - Vec(view.camera.position));
  const Vec sideways = cross(view.forward, unit(view.camera.up));
  if (length(sideways) < 1e-2L) return std::nullopt;
  view.right = unit(sideways);
  view.up = cross(view.right, view.forward);
  return view;
}

TEST(OrthographicCamera, SendsParallelRaysFromAWindowOfItsHeight) {
  Random random(2);
  for (std::uint64_t i = 0; i < effort::cases(2000); ++i) {
    const auto view = random_view(random, Camera::Type::orthographic);
    if (!view) continue;
    const auto camera = trace_camera(view->camera, view->width, view->height);
    const double x = random.in(0, view->width), y = random.in(0, view->height);
    const Real pixel = Real{view->camera.height} / view->height;
    const Vec origin = Vec(view->camera.position) + (pixel * (x - view->width / 2.0L)) * view->right +
                       (pixel * (view->height / 2.0L - y)) * view->up;
    const auto generate_ray = camera.generate_ray(x, y);
    expect_near(generate_ray.origin, origin, 1e-12 * (1 + view->camera.height * view->width));
    expect_near(generate_ray.direction, view->forward, 1e-13);
    EXPECT_NEAR(camera.depth(generate_ray.direction, 3), 3, 1e-14);
    if (HasFailure()) return;
  }
}

TEST(PanoramaCamera, CoversTheGlobeByLongitudeAndLatitude) {
  Random random(3);
  constexpr Real pi = std::numbers::pi_v<Real>;
  for (std::uint64_t i = 0; i < effort::cases(2000); ++i) {
    const auto view = random_view(random, Camera::Type::panorama);
    if (!view) continue;
    const auto camera = trace_camera(view->camera, view->width, view->height);
    const double x = random.in(0, view->width), y = random.in(0, view->height);
    const Real longitude = (2 * Real{x} / view->width - 1) * pi, latitude = (0.5L - Real{y} / view->height) * pi;
    const Vec expected = (std::cos(latitude) * std::cos(longitude)) * view->forward +
                         (std::cos(latitude) * std::sin(longitude)) * view->right + std::sin(latitude) * view->up;
    const auto generate_ray = camera.generate_ray(x, y);
    expect_near(generate_ray.direction, expected, 1e-13);
    EXPECT_EQ(generate_ray.origin, view->camera.position);
    EXPECT_EQ(camera.depth(generate_ray.direction, 3), 3) << "its axis is the ray";
    if (HasFailure()) return;
  }
}

TEST(Lens, KeepsWhatIsInFocusSharpAndItsCentreIsThePinhole) {
  Random random(4);
  for (const auto type : {Camera::Type::perspective, Camera::Type::orthographic, Camera::Type::panorama}) {
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

TEST(Lens, FocusesOnLookAtByDefault) {
  Camera c{{0, 0, 5}, {0, 0, 1}, {0, 1, 0}, 60};
  c.aperture = 1;
  const auto given = [&] {
    Camera other = c;
    other.focus_distance = 4;
    return trace_camera(other, 9, 9);
  }();
  const auto camera = trace_camera(c, 9, 9);
  EXPECT_EQ(camera.generate_ray(2, 3, {0.1, 0.9}).direction, given.generate_ray(2, 3, {0.1, 0.9}).direction);
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

TEST(LensSamples, AreTheCentreWhenThereIsOneAndStratifiedWhenThereAreMore) {
  EXPECT_EQ(lens_sample(pixel_key(7, 1), 0, 1), (Vec2{0.5, 0.5}));
  for (std::uint64_t pixel = 0; pixel < 200; ++pixel) {
    std::uint32_t seen = 0;
    for (std::uint32_t s = 0; s < 16; ++s) {
      const Vec2 xi = lens_sample(pixel_key(pixel, 3), s, 16);
      seen |= 1u << (static_cast<std::uint32_t>(xi.x * 4) * 4 + static_cast<std::uint32_t>(xi.y * 4));
    }
    EXPECT_EQ(seen, 0xffffu) << "one in each of 4 x 4 squares";
  }
}

TEST(LensSamples, AreIndependentOfThePositionInThePixel) {
  // Of 16 samples, independent uniform numbers have a covariance of variance (1/12)^2 / 15 over pixels; the same
  // sequence in the same order has more than eight times that, since halves of one go with halves of the other.
  constexpr int pixels = 4000, count = 16;
  double of[2][2] = {};
  for (std::uint64_t pixel = 0; pixel < pixels; ++pixel) {
    double covariance[2][2] = {};
    for (std::uint32_t s = 0; s < count; ++s) {
      const Vec2 at = pixel_sample(pixel, s, count, 5), lens = lens_sample(pixel_key(pixel, 5), s, count);
      const double p[] = {at.x - 0.5, at.y - 0.5}, l[] = {lens.x - 0.5, lens.y - 0.5};
      for (int i = 0; i < 2; ++i)
        for (int j = 0; j < 2; ++j) covariance[i][j] += p[i] * l[j] / count;
    }
    for (int i = 0; i < 2; ++i)
      for (int j = 0; j < 2; ++j) of[i][j] += covariance[i][j] * covariance[i][j] / pixels;
  }
  for (int i = 0; i < 2; ++i)
    for (int j = 0; j < 2; ++j) EXPECT_LT(of[i][j] * 144 * 15, 2) << i << ' ' << j;
}

TEST(Camera, AimsManyRaysAsItAimsEach) {
  for (const auto type : {Camera::Type::perspective, Camera::Type::orthographic, Camera::Type::panorama}) {
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
