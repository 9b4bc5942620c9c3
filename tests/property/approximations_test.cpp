// Approximations: each omits exactly the effects that it names.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/property/global_radiance.h"
#include "tests/support/effort.h"
#include "tracer/src/compiled/compiled_scene.h"

namespace {

using namespace tracer;

constexpr Approximations no_shadows{.shadows = Approximations::Shadows::none};
constexpr Approximations no_reflections{.reflections = Approximations::Reflections::none};
constexpr Approximations environment_alone{.reflections = Approximations::Reflections::environment};

template <class Change>
Scene with_materials(Scene scene, const Change& change) {
  for (Material& material : scene.materials) change(material);
  return scene;
}

/// Meshes with normals of their own and without, a ball beside them, a mirror under them; shaded in every way.
Scene shapes() {
  Scene scene = scenes::empty(48, {{1, 3, 7}, {0, 0, 0}, {0, 1, 0}, 50});
  scene.lights = {scenes::point_light({3, 5, 4}), scenes::directional_light({1, -2, -1}, {0.3, 0.2, 0.1})};
  const auto shaded = [](Material::Shading shading) {
    Material material = scenes::matte({0.7, 0.5, 0.3});
    material.shading = shading;
    return material;
  };
  scenes::add(scene, scenes::placed(scenes::icosphere(1, true), 1, {-2, 0, 0}), shaded(Material::Shading::smooth));
  scenes::add(scene, scenes::placed(scenes::icosphere(1, true), 1, {0, 0, 1}), shaded(Material::Shading::flat));
  scenes::add(scene, scenes::placed(scenes::icosphere(1, true), 1, {2, 0, 0}), shaded(Material::Shading::gouraud));
  scenes::add(scene, Sphere{{0, 0, -2}, 1}, shaded(Material::Shading::smooth));
  scenes::add(scene, Plane{{0, -1, 0}, {0, 1, 0}, {}}, scenes::mirror(0.5));
  return scene;
}

TEST(WithoutShadows, EveryLightIsUnoccluded) {
  std::uint64_t shadow_rays = 0;
  for (std::uint64_t seed = 0; seed < effort::cases(100); ++seed) {
    const Scene scene = scenes::random(seed, 24);
    Scene shadowless = scene;
    for (Light& light : shadowless.lights) light.shadows = false;
    const Rendered seen = scenes::approximated(scene, no_shadows), expected = scenes::approximated(shadowless, {});
    ASSERT_EQ(seen.image.rgb, expected.image.rgb) << seed;
    ASSERT_EQ(seen.statistics, expected.statistics) << seed;
    ASSERT_EQ(seen.statistics.rays.shadow, 0u) << seed;
    shadow_rays += scenes::render(scene).statistics.rays.shadow;
  }
  EXPECT_GT(shadow_rays, 0u) << "there was nothing to leave out";
}

TEST(WithoutShadows, NoLightIsCulled) {
  Scene scene = scenes::empty(8, {{0, 5, 0.1}, {0, 0, 0}, {0, 1, 0}, 60});
  scene.accuracy.cutoff = 0.5;
  scenes::add(scene, Plane{{0, 0, 0}, {0, 1, 0}, {}}, scenes::matte({1, 1, 1}));
  for (int i = 0; i < 70; ++i) scene.lights.push_back(scenes::point_light({0.1 * i, 1, 0}, {1e-3, 1e-3, 1e-3}));
  const Rendered exact = scenes::render(scene), seen = scenes::approximated(scene, no_shadows);
  EXPECT_GT(exact.statistics.culled_shadow_rays, 0u);
  EXPECT_EQ(seen.statistics.culled_shadow_rays, 0u);
  EXPECT_GT(*seen.image.pixel(4, 4), *exact.image.pixel(4, 4));
}

TEST(WithoutReflections, MirrorsAreBlack) {
  std::uint64_t reflected = 0;
  for (std::uint64_t seed = 0; seed < effort::cases(100); ++seed) {
    const Scene scene = with_materials(scenes::random(seed, 24), [](Material& material) {
      material.transmission = 0;
      material.opacity = Color{1, 1, 1};
    });
    const Scene dull = with_materials(scene, [](Material& material) { material.reflection = 0; });
    const Rendered seen = scenes::approximated(scene, no_reflections), expected = scenes::approximated(dull, {});
    ASSERT_EQ(seen.image.rgb, expected.image.rgb) << seed;
    ASSERT_EQ(seen.statistics, expected.statistics) << seed;
    reflected += scenes::render(scene).statistics.rays.reflection;
  }
  EXPECT_GT(reflected, 0u) << "there was nothing to leave out";
}

TEST(WithoutReflections, GlassHasItsLocalShadingAndTransmitsShadowRays) {
  Scene scene = scenes::empty(24, {{0, 3, 6}, {0, 0, 0}, {0, 1, 0}, 45});
  scene.background.color = {1, 2, 3};
  scene.lights = {scenes::point_light({4, 5, 0})};
  Material glass = scenes::glass();
  glass.emission = Color{0.25, 0.5, 0.75};
  glass.transmission_color = Color{0.5, 1, 0};
  glass.color = Color{0, 0, 0};
  scenes::add(scene, Sphere{{0, 1, 0}, 1}, glass);
  scenes::add(scene, Plane{{0, 0, 0}, {0, 1, 0}, {}}, scenes::matte({1, 1, 1}));
  const Rendered exact = scenes::render(scene), seen = scenes::approximated(scene, no_reflections);
  EXPECT_GT(exact.statistics.rays.refraction, 0u);
  EXPECT_EQ(seen.statistics.rays.refraction + seen.statistics.rays.reflection, 0u);
  const float* ball = seen.image.pixel(12, 9);
  EXPECT_EQ((std::array{ball[0], ball[1], ball[2]}), (std::array{0.25f, 0.5f, 0.75f}));
  std::uint64_t tinted = 0;
  for (std::uint32_t i = 0; i < 24 * 24; ++i) {
    const float* rgb = seen.image.rgb.data() + 3 * i;
    const bool on_ball = rgb[0] == 0.25f && rgb[2] == 0.75f;
    if (on_ball) continue;
    for (int c = 0; c < 3; ++c) EXPECT_EQ(rgb[c], exact.image.rgb[3 * i + c]);
    tinted += rgb[2] == 0 && rgb[1] > 0 ? 1 : 0;
  }
  EXPECT_GT(tinted, 10u) << "green light through the ball, but for what it mirrors on both sides";
}

TEST(EnvironmentReflections, ReturnTheBackgroundOfAnEmptyScene) {
  Scene scene = scenes::empty(32, {{0, 0, 6}, {0, 0, 0}, {0, 1, 0}, 30});
  scene.background.gradient = Gradient{{0.1, 0.4, 0.9}, {0.8, 0.3, 0.05}};
  Material mirror = scenes::mirror(0.75);
  mirror.reflection_color = Color{1, 0.5, 0.25};
  scenes::add(scene, Sphere{{0, 0, 0}, 1}, mirror);
  const Rendered alone = scenes::render(scene);
  scenes::add(scene, Sphere{{0, 0, 12}, 5}, scenes::glowing({9, 9, 9}));  // behind the camera
  const Rendered exact = scenes::render(scene), seen = scenes::approximated(scene, environment_alone);
  EXPECT_NE(exact.image.rgb, alone.image.rgb);
  EXPECT_EQ(seen.image.rgb, alone.image.rgb);
  EXPECT_EQ(seen.statistics.rays.reflection, 0u);
}

TEST(EnvironmentReflections, OfGlassBeforeOneColourAreThatColour) {
  Scene scene = scenes::empty(32, {{0, 0, 6}, {0, 0, 0}, {0, 1, 0}, 30});
  scene.background.color = {0.25, 0.5, 1};
  Material glass = scenes::glass();
  glass.absorption = {100, 100, 100};  // of no length: nothing is on the other side
  scenes::add(scene, Sphere{{0, 0, 0}, 1}, glass);
  const Rendered seen = scenes::approximated(scene, environment_alone);
  for (std::size_t i = 0; i < seen.image.rgb.size(); ++i)
    EXPECT_FLOAT_EQ(seen.image.rgb[i], i % 3 == 0 ? 0.25f : i % 3 == 1 ? 0.5f : 1.0f);  // R + T = 1
  EXPECT_EQ(seen.statistics.rays.total(), seen.statistics.rays.camera);
}

TEST(EnvironmentReflections, ObserveCutoffAndDepth) {
  Scene scene = scenes::empty(8, {{0, 0, 6}, {0, 0, 0}, {0, 1, 0}, 10});
  scene.background.color = {1, 1, 1};
  scenes::add(scene, Sphere{{0, 0, 0}, 1}, scenes::mirror(0.5));
  EXPECT_EQ(*scenes::approximated(scene, environment_alone).image.pixel(4, 4), 0.5f);
  Scene shallow = scene;
  scene.accuracy.cutoff = 0.6;
  shallow.accuracy.max_depth = 0;
  const Rendered cut = scenes::approximated(scene, environment_alone),
                 truncated = scenes::approximated(shallow, environment_alone);
  EXPECT_EQ(*cut.image.pixel(4, 4), 0.0f);
  EXPECT_EQ(*truncated.image.pixel(4, 4), 0.0f);
  EXPECT_EQ(cut.statistics.cut_branches, 64u);
  EXPECT_EQ(truncated.statistics.truncated_branches, 64u);
}

TEST(ApproximateShading, IsThatOfEveryMaterial) {
  using By = Approximations::Shading;
  const Rendered exact = scenes::render(shapes());
  for (const auto& [by, shading] :
       {std::pair{By::flat, Material::Shading::flat}, {By::gouraud, Material::Shading::gouraud}}) {
    const Rendered seen = scenes::approximated(shapes(), {.shading = by});
    const Rendered expected =
        scenes::render(with_materials(shapes(), [shading = shading](Material& each) { each.shading = shading; }));
    EXPECT_EQ(seen.image.rgb, expected.image.rgb);
    EXPECT_EQ(seen.statistics, expected.statistics);
    EXPECT_NE(seen.image.rgb, exact.image.rgb);
  }
}

/// A floor seen from above, x to the right.
Scene floor_under(std::vector<Light> lights) {
  Scene scene = scenes::empty(16, {{0, 8, 0}, {0, 0, 0}, {0, 0, -1}, 60});
  scenes::add(scene, Plane{{0, 0, 0}, {0, 1, 0}, {}}, scenes::matte({1, 1, 1}));
  scene.lights = std::move(lights);
  return scene;
}

TEST(NearestLights, AreAllLightsIfThereAreNoMore) {
  for (std::uint64_t seed = 0; seed < effort::cases(50); ++seed) {
    const Scene scene = scenes::random(seed, 16);
    const auto count = static_cast<std::uint32_t>(std::max<std::size_t>(scene.lights.size(), 1));
    const Rendered seen = scenes::approximated(scene, {.nearest_lights = count}),
                   exact = scenes::approximated(scene, {});
    ASSERT_EQ(seen.image.rgb, exact.image.rgb) << seed;
    ASSERT_EQ(seen.statistics, exact.statistics) << seed;
  }
}

TEST(NearestLights, AreSelectedPerHitAndDirectionalLightsAlwaysCount) {
  const Light left = scenes::point_light({-2, 1, 0}, {1, 0, 0}), right = scenes::point_light({2, 1, 0}, {0, 1, 0});
  const Light sun = scenes::directional_light({0, -1, 0}, {0, 0, 0.5});
  const Scene scene = floor_under({right, sun, left});
  const Rendered seen = scenes::approximated(scene, {.nearest_lights = 1}), exact = scenes::render(scene);
  for (std::uint32_t y = 0; y < 16; ++y)
    for (std::uint32_t x = 0; x < 16; ++x) {
      const float *one = seen.image.pixel(x, y), *all = exact.image.pixel(x, y);
      EXPECT_EQ(one[0], x < 8 ? all[0] : 0);
      EXPECT_EQ(one[1], x < 8 ? 0 : all[1]);
      EXPECT_EQ(one[2], 0.5f);
    }
  EXPECT_EQ(seen.statistics.rays.shadow, 2 * 256u);
  EXPECT_EQ(exact.statistics.rays.shadow, 3 * 256u);
}

TEST(NearestLights, AreTheFirstOfLightsAtEqualDistance) {
  const Scene scene =
      floor_under({scenes::point_light({0, 1, 0}, {1, 0, 0}), scenes::point_light({0, 1, 0}, {0, 1, 0})});
  const Rendered seen = scenes::approximated(scene, {.nearest_lights = 1});
  EXPECT_GT(seen.image.pixel(8, 8)[0], 0);
  EXPECT_EQ(seen.image.pixel(8, 8)[1], 0);
}

TEST(NearestLights, HaveTheDistanceOfTheirCenter) {
  const Light bar{LineLight{{-4, 1, 0}, {8, 1, 0}}, {1, 0, 0}};  // its middle is at x = 2
  const Scene scene = floor_under({bar, scenes::point_light({-2, 1, 0}, {0, 1, 0})});
  const Rendered seen = scenes::approximated(scene, {.nearest_lights = 1});
  EXPECT_EQ(seen.image.pixel(2, 8)[0], 0);
  EXPECT_GT(seen.image.pixel(2, 8)[1], 0);
  EXPECT_GT(seen.image.pixel(13, 8)[0], 0);
  EXPECT_EQ(seen.image.pixel(13, 8)[1], 0);
}

constexpr Approximations ambient_alone{.interreflection = Approximations::Interreflection::ambient};
constexpr Approximations no_interreflection{.interreflection = Approximations::Interreflection::none};

Scene global_scene(std::uint64_t seed) {
  Scene scene = scenes::random(seed, 16);
  scenes::light_globally(scene);
  scene.ambient = {0.3, 0.2, 0.1};
  return scene;
}

/// With the estimate of its error.
Rendered rendered_by(Scene scene, const Approximations& approximations) {
  scene.accuracy.approximate = approximations;
  return scenes::render(scene);
}

Scene whitted(Scene scene) {
  scene.accuracy.model = Accuracy::Model::whitted;
  return scene;
}

TEST(AmbientInterreflection, IsTheWhittedImage) {
  double model_error = 0;
  for (std::uint64_t seed = 0; seed < effort::cases(6); ++seed) {
    const Scene scene = global_scene(seed);
    const Rendered seen = rendered_by(scene, ambient_alone), expected = scenes::render(whitted(scene));
    ASSERT_EQ(seen.image.rgb, expected.image.rgb) << seed;
    ASSERT_EQ(seen.error.sampling, expected.error.sampling) << seed;
    ASSERT_EQ(seen.error.depth, expected.error.depth) << seed;
    ASSERT_EQ(seen.error.cutoff, expected.error.cutoff) << seed;
    ASSERT_EQ(expected.statistics.rays.diffuse, 0u);
    model_error += seen.error.approximation;
  }
  EXPECT_GT(model_error, 0) << "the ambient term equalled the light of surfaces";
}

TEST(NoInterreflection, IsTheWhittedImageWithoutAmbientTerm) {
  for (std::uint64_t seed = 0; seed < effort::cases(3); ++seed) {
    Scene scene = global_scene(seed);
    const Rendered seen = rendered_by(scene, no_interreflection);
    scene.ambient = {};
    ASSERT_EQ(seen.image.rgb, scenes::render(whitted(scene)).image.rgb) << seed;
  }
}

TEST(InterreflectionError, IsTheDistanceFromTheRenderingEquation) {
  // Within a sphere with emission E and reflectance rho the radiance is E / (1 - rho) everywhere.
  constexpr double rho = 0.6, emission = 0.1, exact = emission / (1 - rho);
  for (const double ambient : {0.0, 0.05, 0.25}) {
    Scene scene = scenes::empty(32, {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 60});
    scene.accuracy.model = Accuracy::Model::global;
    scene.accuracy.max_depth = 1000;
    scene.accuracy.samples = 4096;  // so that many looks are a tenth of them
    scene.ambient = {ambient, ambient, ambient};
    Material wall = scenes::matte({1, 1, 1});
    wall.diffuse = rho;
    wall.emission = Color{emission, emission, emission};
    scenes::add(scene, Sphere{{0, 0, 0}, 1}, wall);
    const ErrorEstimate error = rendered_by(scene, ambient_alone).error;
    const double truth = std::abs(level_of(emission + ambient) - level_of(exact));
    EXPECT_NEAR(error.approximation, truth, 0.1 * truth) << ambient;
    EXPECT_GE(error.estimate, truth) << ambient;
  }
}

TEST(Approximation, RemovesTheRequirementsOfWhatItOmits) {
  Scene scene = shapes();
  scene.materials[0] = scenes::glass();
  scene.materials[0].absorption = {1, 1, 1};
  const auto needs = [&](const Approximations& approximations) {
    scene.accuracy.approximate = approximations;
    return requirements(scene);
  };
  const Requirements exact = needs({});
  EXPECT_TRUE(exact.reflection && exact.refraction && exact.fresnel && exact.shadows && exact.transmissive_shadows &&
              exact.gouraud && exact.smooth_normals && exact.absorption && !exact.approximations);
  const Requirements unshadowed = needs(no_shadows);
  EXPECT_TRUE(unshadowed.approximations && unshadowed.refraction);
  EXPECT_FALSE(unshadowed.shadows || unshadowed.transmissive_shadows);
  const Requirements mapped = needs({.shadows = Approximations::Shadows::map});
  EXPECT_FALSE(mapped.shadows || mapped.transmissive_shadows);
  const Requirements dull = needs(no_reflections);
  EXPECT_FALSE(dull.reflection || dull.refraction || dull.fresnel);
  EXPECT_TRUE(dull.transmissive_shadows);
  const Requirements outside = needs(environment_alone);
  EXPECT_FALSE(outside.reflection || outside.refraction);
  EXPECT_TRUE(outside.fresnel);
  const Requirements flat = needs({.shading = Approximations::Shading::flat});
  EXPECT_FALSE(flat.gouraud || flat.smooth_normals);
  EXPECT_TRUE(needs({.shading = Approximations::Shading::gouraud}).gouraud);
  scene.accuracy.model = Accuracy::Model::global;
  scene.materials[1].emission = Color{1, 1, 1};
  EXPECT_TRUE(needs({}).global_light && needs({}).emitters);
  EXPECT_FALSE(needs(ambient_alone).global_light || needs(ambient_alone).emitters);
  EXPECT_FALSE(needs(no_interreflection).global_light || needs(no_interreflection).emitters);
}

TEST(Approximation, KeepsInTheCompiledSceneWhatExactSamplesNeed) {
  const Approximations all{.shadows = Approximations::Shadows::map,
                           .reflections = Approximations::Reflections::none,
                           .shading = Approximations::Shading::flat,
                           .interreflection = Approximations::Interreflection::none,
                           .nearest_lights = 1};
  for (std::uint64_t seed = 0; seed < effort::cases(60); ++seed) {
    Scene scene = seed == 0 ? shapes() : scenes::random(seed, 16);
    if (seed % 3 == 2) scene = global_scene(seed);
    const Rendered exact = scenes::render(scene);
    scene.accuracy.approximate = all;
    RenderControl control;
    const auto compiled = *compile(scene, control);
    // compile made it, and no one else looks at it.
    auto& changed = const_cast<CompiledScene&>(*compiled);
    changed.accuracy.approximate = {};
    changed.needs = changed.exact.needs;
    const Rendered seen = *render(*compiled, {}, control);
    ASSERT_EQ(seen.image.rgb, exact.image.rgb) << seed;
    ASSERT_EQ(seen.statistics, exact.statistics) << seed;
  }
}

}  // namespace
