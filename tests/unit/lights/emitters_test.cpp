// Directions toward emitters: each is as frequent as its density, whatever the shape.
#include "tracer/src/lights/emitters.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <set>

#include "tests/support/chi_square.h"
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

PrimitiveRef first_hit(const CompiledScene& scene, const Vec3& from, const Vec3& d) {
  Hit hit;
  scene.accelerator->intersect({&from.x, &from.y, &from.z, &d.x, &d.y, &d.z, nullptr, nullptr, 1},
                               {&hit.primitive, &hit.t, &hit.u, &hit.v}, Coherence::incoherent);
  return hit.primitive;
}

/// Leaves out directions that do not hit first what they are sampled for.
void expect_sampled_by_density(const CompiledScene& scene, const Vec3& world) {
  const Emitters& emitters = scene.objects.emitters;
  const Vec3 from = scene.frame.render_from_world(world);
  const auto sample = [&](const Vec2& xi) {
    Emitters::Sample one = emitters.sample(from, xi);
    if (first_hit(scene, from, one.direction) != one.primitive) one.density = 0;
    return one;
  };
  const auto density = [&](const Vec3& d) {
    const PrimitiveRef primitive = first_hit(scene, from, d);
    return primitive.hit() ? emitters.density(primitive, from, d) : emitters.density_of_sky(from, d);
  };
  statistics::expect_sampled_by_density(sample, density, normalize({1, 2, 3}), -1);
}

TEST(Emitters, AreSampledByTheirDensity) {
  const Shape shapes[] = {
      Sphere{{0, 0, 2}, 1},
      Sphere{{0, 0, 0.3}, 1},
      Disc{{0, 0, 1}, {0, 0, 1}, 1, 0.5, {}},
      Mesh{{{-1, -1, 1}, {1, -1, 1}, {1, 1, 1}, {-1, 1, 1}}, {{0, 1, 2}, {0, 2, 3}}, {}, {}, false},
      Box{{-1, -1, -1}, {1, 1, 1}},
      Box{{-1, -1, 1}, {1, 1, 2}},
      Cylinder{{0, 0, 1}, {0, 0, 2}, 1, true, {}},
  };
  for (const Shape& shape : shapes) expect_sampled_by_density(*compiled(glowing(shape)), {});
  Scene ellipsoid = glowing(Sphere{{0, 0, 0}, 1});
  ellipsoid.objects[0].transform = Transform{{{{0, -1, 0, 0}, {1, 0, 0, 0}, {0, 0, 3, 6}}}};
  expect_sampled_by_density(*compiled(ellipsoid), {});
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

TEST(Emitters, AreSampledByTheirDensityWithASky) {
  Scene scene = under_checkered_sky();
  expect_sampled_by_density(*compiled(scene), {});
  scenes::add(scene, Sphere{{0, 0, 2}, 1}, scenes::glowing({30, 1, 1}));
  scenes::add(scene, Disc{{3, 1, 4}, {0, 1, 1}, 2, 0, {}}, scenes::glowing({1, 30, 1}));
  scenes::add(scene, Triangle{{{{-3, 0, 1}, {-3, 2, 1}, {-2, 1, 5}}}, {}, {}}, scenes::glowing({90, 1, 1}));
  for (const Vec3& from : {Vec3{}, Vec3{2, 0, 3}}) expect_sampled_by_density(*compiled(scene), from);
}

TEST(LightTree, SelectsEachOfManyLampsWithItsProbability) {
  constexpr std::size_t count = 1000, samples = 1'000'000;
  oracle::Random random(1);
  std::vector<LightTree::Lamp> lamps(count);
  for (LightTree::Lamp& lamp : lamps) {
    lamp.bounds.include(random.vector(10), {0.1, 0.1, 0.1});
    lamp.power = random.spread(0.1, 10);
  }
  const LightTree tree(lamps);
  for (const Vec3& from : {Vec3{}, lamps[7].bounds.low, Vec3{0, 99, 0}}) {
    std::vector<double> found(2 * count), expected = found;  // of both halves of the numbers that select a lamp
    for (std::size_t i = 0; i < 2 * count; ++i) expected[i] = samples * tree.probability(from, i / 2) / 2;
    for (std::size_t i = 0; i < samples; ++i) {
      const Selected one = tree.select(from, random.in(0, 1));
      ASSERT_NEAR(one.probability, tree.probability(from, one.index), 1e-12);
      ++found[2 * one.index + (one.position < 0.5 ? 0 : 1)];
    }
    EXPECT_LT(statistics::chi_square_deviate(found, expected), statistics::deviate_max);
  }
}

TEST(SkyOpenings, AreSampledByADensityThatIsPositiveInAllOfAWindow) {
  const Bounds box{{-1, 0, 2}, {3, 2, 5}};  // with a window at high x
  oracle::Random random(1);
  const auto inside = [&] { return Vec3{random.in(-1, 2.9), random.in(0, 2), random.in(2, 5)}; };
  const auto to_window = [&](const Vec3& from) {
    return normalize(Vec3{3, random.in(0.5, 1.3), random.in(3, 4.5)} - from);
  };
  std::vector<SkySighting> sightings(1 << 14);
  for (SkySighting& one : sightings) {
    one = {inside(), {}, 1, 1};
    one.direction = to_window(one.from);
  }
  const SkyOpenings openings(box, sightings);
  for (const Vec3& from : {Vec3{0, 1, 3}, Vec3{2.9, 0.6, 4}, Vec3{-0.999, 1.999, 2.001}})
    statistics::expect_sampled_by_density([&](const Vec2& xi) { return openings.sample(from, xi); },
                                          [&](const Vec3& d) { return openings.density(from, d); },
                                          normalize(Vec3{3, 0.9, 3.75} - from), from.x > 2 ? -1 : 0.85);
  for (int i = 0; i < 100'000; ++i) {
    const Vec3 from = inside();
    ASSERT_GT(openings.density(from, to_window(from)), 0);
  }
}

TEST(Emitters, ShareTheirSamplesWithTheSkyByTheLightOfBoth) {
  Scene scene = under_checkered_sky();
  scenes::add(scene, Sphere{{0, 0, 2}, 1}, scenes::glowing({20, 1, 1}));
  const double sphere = 20 * 4 * pi / 4, sky = 4 * pi * 5;  // power over squared distance; mean radiance of all sides
  const auto made = compiled(scene);
  EXPECT_NEAR(share_of(*made, {0, 0}, made->frame.render_from_world(Vec3{})), sphere / (sphere + sky), 0.01);
}

TEST(Emitters, AreSampledInPacketsOfPointsAsOneByOne) {
  Scene scene = under_checkered_sky();
  scenes::add(scene, Sphere{{0, 0, 2}, 1}, scenes::glowing({30, 1, 1}));
  scenes::add(scene, Disc{{3, 1, 4}, {0, 1, 1}, 2, 0, {}}, scenes::glowing({1, 30, 1}));
  scenes::add(scene, Triangle{{{{-3, 0, 1}, {-3, 2, 1}, {-2, 1, 5}}}, {}, {}}, scenes::glowing({90, 1, 1}));
  const auto made = compiled(scene);
  const Emitters& emitters = made->objects.emitters;
  std::set<std::uint32_t> geometries;
  oracle::Random random(5);
  for (std::uint32_t packet = 0; packet < 64; ++packet) {
    VecLanes from;
    double x[lanes], y[lanes];
    for (int i = 0; i < lanes; ++i) {
      const Vec2 xi{random.in(0, 1), random.in(0, 1)};
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
      EXPECT_NEAR(one.density, density, 1e-9 * density);
      geometries.insert(one.primitive.geometry);
    });
  }
  EXPECT_EQ(geometries.size(), 4u) << "sphere, disc, triangle and sky";
}

TEST(Emitters, HaveADensityTowardOpeningsFromInsideOfARoomAlone) {
  Scene scene = scenes::empty(64);
  scene.camera = {{1, 0, 1}, {0, 0, 0}, {0, 1, 0}, 90};
  scene.background.color = {1, 1, 1};
  scenes::add(scene, Cylinder{{0, 0, 0}, {0, 0, 3}, 2, false, {}}, scenes::matte({0.5, 0.5, 0.5}));
  for (const double z : {0.0, 3.0})
    scenes::add(scene, Disc{{0, 0, z}, {0, 0, 1}, 2, z == 0 ? 0 : 0.5, {}}, scenes::matte({0.5, 0.5, 0.5}));
  for (const bool lamp : {false, true}) {
    if (lamp) scenes::add(scene, Sphere{{0, 1, 1}, 0.2}, scenes::glowing({1, 1, 1}));
    const auto made = compiled(scene);
    const Vec3 outside = made->frame.render_from_world({9, 0, 1});
    const auto place = [&](const Vec2& xi) { return made->frame.render_from_world({2 * xi.x - 1, 2 * xi.y - 1, 1}); };
    const Vec3 up{0, 0, 1};
    for (std::uint32_t i = 0; i < 1000; ++i) {
      const Vec2 xi = sequence_point(i, mix(8)), to = sequence_point(i, mix(9));
      const Vec3 offset = made->frame.render_from_world({0.6 * to.x - 0.3, 0.6 * to.y - 0.3, 3}) - place(xi);
      EXPECT_GT(made->objects.emitters.density_of_sky(place(xi), normalize(offset)), 0) << "through the window";
    }
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
