// Directions toward emitters: their density integrates to the solid angle of what is seen, whatever the shape.
#include "tracer/src/lights/emitters.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <set>

#include "tests/support/scenes.h"
#include "tracer/src/compiled/compiled_scene.h"
#include "tracer/src/interaction/surface.h"
#include "tracer/src/math/sampling.h"

namespace {

using namespace tracer;

constexpr double pi = std::numbers::pi;

std::shared_ptr<const CompiledScene> compiled(Scene scene) {
  scene.accuracy.model = Accuracy::Model::global;
  scenes::add(scene, Plane{{0, 0, -1000}, {0, 0, 1}, {}}, scenes::matte({1, 1, 1}));
  return scenes::compiled(scene);
}

Scene glowing(const Shape& shape) {
  Scene scene = scenes::empty(1);
  scenes::add(scene, shape, scenes::glowing({1, 1, 1}));
  return scene;
}

struct Estimate {
  double mean = 0, error = 0;
};

/// Mean of 1 / density over the sampled directions that hit the sampled primitive first: the solid angle of all.
Estimate solid_angle(const CompiledScene& scene, const Vec3& from) {
  constexpr std::uint32_t count = 1 << 14;
  double sum = 0, squares = 0;
  for (std::uint32_t i = 0; i < count; ++i) {
    const Emitters::Sample sample = scene.objects.emitters.sample(from, sequence_point(i, mix(7)));
    if (!sample.primitive.hit()) continue;  // the sky
    EXPECT_NEAR(sample.density, scene.objects.emitters.density(sample.primitive, from, sample.direction),
                1e-9 * sample.density);
    EXPECT_NEAR(length(sample.direction), 1, 1e-12);
    Hit hit;
    const Vec3& d = sample.direction;
    scene.accelerator->intersect({&from.x, &from.y, &from.z, &d.x, &d.y, &d.z, nullptr, nullptr, 1},
                                 {&hit.primitive, &hit.t, &hit.u, &hit.v}, Coherence::incoherent);
    const double value = hit.primitive == sample.primitive ? 1 / sample.density : 0;
    sum += value;
    squares += value * value;
  }
  const double mean = sum / count;
  return {mean, std::sqrt(std::max(0.0, squares / count - mean * mean) / count)};
}

void expect_solid_angle(const Scene& scene, const Vec3& world, double truth, const std::string& name) {
  const auto made = compiled(scene);
  const Estimate found = solid_angle(*made, made->frame.render_from_world(world));
  EXPECT_LE(std::abs(found.mean - truth), 4 * found.error + 1e-6)
      << name << ": " << found.mean << ", must be " << truth;
  EXPECT_LE(std::abs(found.mean - truth), 0.01 * truth) << name;
}

TEST(Emitters, HaveADensityThatIntegratesToTheirSolidAngle) {
  const auto cone = [](double cosine) { return 2 * pi * (1 - cosine); };
  const double square = 4 * std::asin(0.5);  // of 2 x 2, 1 away
  struct Case {
    const char* name;
    Shape shape;
    double truth;
    Vec3 from{};
  };
  const Case cases[] = {
      {"sphere", Sphere{{0, 0, 2}, 1}, cone(std::sqrt(0.75))},
      {"sphere from inside", Sphere{{0, 0, 0}, 1}, 4 * pi, {0.3, 0, 0}},
      {"disc", Disc{{0, 0, 1}, {0, 0, 1}, 1, 0, {}}, cone(std::sqrt(0.5))},
      {"ring", Disc{{0, 0, 1}, {0, 0, 1}, 1, 0.5, {}}, cone(std::sqrt(0.5)) - cone(std::sqrt(0.8))},
      {"square", Mesh{{{-1, -1, 1}, {1, -1, 1}, {1, 1, 1}, {-1, 1, 1}}, {{0, 1, 2}, {0, 2, 3}}, {}, {}, false}, square},
      {"box from inside", Box{{-1, -1, -1}, {1, 1, 1}}, 4 * pi},
      {"box", Box{{-1, -1, 1}, {1, 1, 2}}, square},
      {"cylinder with its lower cap in sight", Cylinder{{0, 0, 1}, {0, 0, 2}, 1, true, {}}, cone(std::sqrt(0.5))},
  };
  for (const auto& [name, shape, truth, from] : cases) expect_solid_angle(glowing(shape), from, truth, name);
  Scene ellipsoid = glowing(Sphere{{0, 0, 0}, 1});
  ellipsoid.objects[0].transform = Transform{{{{0, -1, 0, 0}, {1, 0, 0, 0}, {0, 0, 3, 6}}}};
  const double tangent = 1 / std::sqrt(36.0 - 9);  // of the cone: 1/3 over the root of (6/3)^2 - 1
  expect_solid_angle(ellipsoid, {0, 0, 0}, cone(1 / std::sqrt(1 + tangent * tangent)), "ellipsoid");
}

/// Share of the samples with this primitive.
double share_of(const CompiledScene& scene, const PrimitiveRef& primitive, const Vec3& from = {}) {
  constexpr int count = 1 << 12;
  int found = 0;
  for (std::uint32_t i = 0; i < count; ++i)
    found += scene.objects.emitters.sample(from, sequence_point(i, mix(1))).primitive == primitive ? 1 : 0;
  return found / double{count};
}

TEST(Emitters, AreSelectedInProportionToTheirPowerOverTheSquaredDistance) {
  Scene scene = glowing(Sphere{{0, 0, 2}, 1});
  scenes::add(scene, Sphere{{0, 5, 2}, 1}, scenes::glowing({3, 1, 1}));
  scenes::add(scene, Sphere{{0, 9, 2}, 1}, scenes::matte({1, 1, 1}));
  const auto made = compiled(scene);
  EXPECT_NEAR(share_of(*made, {0, 1}, made->frame.render_from_world(Vec3{1e5, 0, 0})), 0.75, 0.01);
  EXPECT_NEAR(share_of(*made, {0, 1}, made->frame.render_from_world(Vec3{0, -3, 2})), 3. / 64 / (1. / 9 + 3. / 64),
              0.01);
  const Vec3 from{}, up{0, 0, 1};
  EXPECT_EQ(made->objects.emitters.density({made->geometry().plane_geometry(), 0}, from, up), 0) << "an infinite plane";
}

/// A checkered sky without black, turned about an inclined axis.
Scene under_checkered_sky() {
  Scene scene = scenes::empty(1);
  scene.background.up = {1, 2, 3};
  scene.textures = {Texture{CheckerTexture{{Color{1, 1, 1}, Color{9, 5, 1}}}, {8, 6}, {}, "/background/environment"}};
  scene.textures.back().wrap = Texture::Wrap::repeat;
  scene.background.environment = Environment{{}, 20};
  return scene;
}

TEST(Emitters, HaveNoDensityTowardSurfacesIfTheSkyIsTheOnlyOne) {
  Scene scene = under_checkered_sky();
  scenes::add(scene, Sphere{{0, 0, -3}, 1}, scenes::matte({0.5, 0.5, 0.5}));
  EXPECT_EQ(compiled(scene)->objects.emitters.density({0, 0}, {0, 0, 0}, {0, 0, -1}), 0);
}

TEST(Emitters, IncludeASkyWithADensityThatIntegratesToTheWholeSphere) {
  const auto made = compiled(under_checkered_sky());
  constexpr std::uint32_t count = 1 << 14;
  double sum = 0, power = 0;
  for (std::uint32_t i = 0; i < count; ++i) {
    const Emitters::Sample sample = made->objects.emitters.sample({}, sequence_point(i, mix(3)));
    ASSERT_FALSE(sample.primitive.hit());
    ASSERT_NEAR(length(sample.direction), 1, 1e-12);
    ASSERT_NEAR(sample.density, made->objects.emitters.density_of_sky({}, sample.direction), 0.3 * sample.density) << i;
    sum += 1 / sample.density / count;
    power += made->background->radiance(sample.direction, 0).r / sample.density / count;
  }
  EXPECT_NEAR(sum, 4 * pi, 0.05);
  double truth = 0;
  for (std::uint32_t i = 0; i < count; ++i) {
    const Vec2 xi = sequence_point(i, mix(4));
    const double z = 1 - 2 * xi.x, across = std::sqrt(1 - z * z);
    const Vec3 direction{across * std::cos(2 * pi * xi.y), across * std::sin(2 * pi * xi.y), z};
    truth += made->background->radiance(direction, 0).r * 4 * pi / count;
  }
  EXPECT_NEAR(power, truth, 0.02 * truth);
}

TEST(Emitters, ShareTheirSamplesWithTheSkyByTheLightOfBoth) {
  Scene scene = under_checkered_sky();
  scenes::add(scene, Sphere{{0, 0, 2}, 1}, scenes::glowing({20, 1, 1}));
  const double sphere = 20 * 4 * pi / 4, sky = 4 * pi * 5;  // power over squared distance; mean radiance of all sides
  const auto made = compiled(scene);
  EXPECT_NEAR(share_of(*made, {0, 0}, made->frame.render_from_world(Vec3{})), sphere / (sphere + sky), 0.01);
  expect_solid_angle(scene, {0, 0, 0}, 2 * pi * (1 - std::sqrt(0.75)), "sphere before a sky");
}

TEST(Emitters, AreSampledInPacketsOfPointsAsOneByOne) {
  Scene scene = under_checkered_sky();
  scenes::add(scene, Sphere{{0, 0, 2}, 1}, scenes::glowing({30, 1, 1}));
  scenes::add(scene, Disc{{3, 1, 4}, {0, 1, 1}, 2, 0, {}}, scenes::glowing({1, 30, 1}));
  scenes::add(scene, Triangle{{{{-3, 0, 1}, {-3, 2, 1}, {-2, 1, 5}}}, {}, {}}, scenes::glowing({90, 1, 1}));
  const auto made = compiled(scene);
  const Emitters& emitters = made->objects.emitters;
  std::set<std::uint32_t> geometries;
  for (std::uint32_t packet = 0; packet < 64; ++packet) {
    VecLanes from;
    double x[lanes], y[lanes];
    for (int i = 0; i < lanes; ++i) {
      const Vec2 xi = sequence_point(packet * lanes + static_cast<std::uint32_t>(i), mix(5));
      from.set(i, Vec3{xi.y, 0.1 * i, xi.x - 1});
      x[i] = xi.x;
      y[i] = xi.y;
    }
    Emitters::SamplePacket found;
    const LaneMask wanted = static_cast<LaneMask>(mix(packet)) & all_lanes;
    emitters.sample(from, x, y, wanted, found);
    for_each_lane(wanted, [&](int i) {
      const Emitters::Sample one = emitters.sample(from[i], {x[i], y[i]});
      EXPECT_EQ(found.primitive[i], one.primitive);
      EXPECT_EQ(found.direction[i], one.direction);
      EXPECT_EQ(found.density[i], one.density);
      const double density = one.primitive.hit() ? emitters.density(one.primitive, from[i], one.direction)
                                                 : emitters.density_of_sky(from[i], one.direction);
      EXPECT_NEAR(one.density, density, (one.primitive.hit() ? 1e-9 : 0.3) * density);
      geometries.insert(one.primitive.geometry);
    });
  }
  EXPECT_EQ(geometries.size(), 4u) << "sphere, disc, triangle and sky";
}

TEST(Emitters, HaveNoDensityTowardOpeningsFromOutsideOfARoom) {
  Scene scene = scenes::empty(64);
  scene.camera = {{1, 0, 1}, {0, 0, 0}, {0, 1, 0}, 90};
  scene.background.color = {1, 1, 1};
  scenes::add(scene, Cylinder{{0, 0, 0}, {0, 0, 3}, 2, false, {}}, scenes::matte({0.5, 0.5, 0.5}));
  for (const double z : {0.0, 3.0})
    scenes::add(scene, Disc{{0, 0, z}, {0, 0, 1}, 2, z == 0 ? 0 : 0.5, {}}, scenes::matte({0.5, 0.5, 0.5}));
  for (const bool lamp : {false, true}) {
    if (lamp) scenes::add(scene, Sphere{{0, 1, 1}, 0.2}, scenes::glowing({1, 1, 1}));
    const auto made = compiled(scene);
    const Vec3 inside = made->frame.render_from_world({0, 0, 1}), outside = made->frame.render_from_world({9, 0, 1});
    const Vec3 up{0, 0, 1};
    EXPECT_GT(made->objects.emitters.density_of_sky(inside, up), 0);
    EXPECT_EQ(made->objects.emitters.density_of_sky(outside, up), 0);
    for (std::uint32_t i = 0; i < 64; ++i) {
      const Emitters::Sample sample = made->objects.emitters.sample(outside, sequence_point(i, mix(8)));
      EXPECT_EQ(sample.density > 0, lamp);
      EXPECT_EQ(sample.primitive.hit(), lamp);
    }
  }
}

TEST(Emitters, AreEmptyUnderABlackOrInfiniteSkyAndWithoutGlobalLight) {
  for (const double radiance : {0.0, std::numeric_limits<double>::infinity()}) {
    Scene scene = under_checkered_sky();
    scene.textures[0].pattern = CheckerTexture{{Color{}, Color{radiance, 0, 0}}};
    EXPECT_TRUE(compiled(scene)->objects.emitters.empty());
  }
  EXPECT_TRUE(scenes::compiled(glowing(Sphere{{0, 0, 2}, 1}))->objects.emitters.empty());
}

}  // namespace
