// Whole images compared with the reference tracer: equal to the last bit of a float, except where a path passes so
// close to an edge that rounding decides.
#include <gtest/gtest.h>

#include <string>

#include "tests/support/effort.h"
#include "tests/support/reference_tracer.h"
#include "tests/support/scenes.h"
#include "tracer/src/math/sampling.h"

namespace {

/// Maximum difference of a pixel from the reference.
struct Tolerance {
  /// Half a unit in the last place of the film's floats, and rounding that several bounces off curved surfaces
  /// amplify.
  oracle::Real relative = 0x1p-24L, absolute = 1e-9L;
  /// Pixels whose path passes closer to an edge are not compared.
  oracle::Real edge = 1e-9L;
};

bool equal(float ours, oracle::Real theirs, const Tolerance& tolerance) {
  return std::fabs(ours - theirs) <= tolerance.relative * theirs + tolerance.absolute;
}

struct Difference {
  std::uint64_t edges = 0;  ///< pixels that differ and whose path passes an edge
  std::uint64_t wrong = 0;  ///< pixels that differ for no such reason
};

Difference compare(const tracer::Image& ours, const std::vector<oracle::Sample>& theirs, const Tolerance& tolerance) {
  Difference difference;
  for (std::size_t i = 0; i < theirs.size(); ++i) {
    const float* rgb = ours.rgb.data() + 3 * i;
    const oracle::Light3& expected = theirs[i].radiance;
    if (equal(rgb[0], expected.r, tolerance) && equal(rgb[1], expected.g, tolerance) &&
        equal(rgb[2], expected.b, tolerance))
      continue;
    const bool edge = theirs[i].margin < tolerance.edge;
    ++(edge ? difference.edges : difference.wrong);
    if (!edge && difference.wrong < 4) {
      ADD_FAILURE() << "pixel (" << i % ours.width << ", " << i / ours.width << ") is " << rgb[0] << " " << rgb[1]
                    << " " << rgb[2] << ", expected " << expected.r << " " << expected.g << " " << expected.b
                    << ", margin " << theirs[i].margin;
    }
  }
  return difference;
}

/// Counts agree exactly where no path is near an edge. Returns the pixels that differ at one.
std::uint64_t expect_reference(const tracer::Scene& scene, const Tolerance& tolerance = {}) {
  tracer::RenderStatistics counted;
  const std::vector<oracle::Sample> theirs = oracle::ReferenceTracer(scene).image(counted);
  const tracer::Rendered ours = scenes::render(scene);
  const Difference difference = compare(ours.image, theirs, tolerance);
  EXPECT_EQ(difference.wrong, 0u);
  bool certain = true;
  for (const oracle::Sample& sample : theirs) certain &= sample.margin >= tolerance.edge;
  if (certain) {
    const tracer::RenderStatistics found = scenes::approximated(scene, {}).statistics;  // without looks
    EXPECT_EQ(found.rays, counted.rays);
    EXPECT_EQ(found.cut_branches, counted.cut_branches);
    EXPECT_EQ(found.truncated_branches, counted.truncated_branches);
  }
  EXPECT_EQ(ours.statistics.non_finite, 0u);
  return difference.edges;
}

TEST(Image, EqualsTheReferenceInEveryPixelAndRayCountOfRandomScenes) {
  std::uint64_t edges = 0;
  const std::uint64_t count = effort::cases(300);
  for (std::uint64_t seed = 1; seed <= count && !HasFailure(); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    edges += expect_reference(scenes::random(seed, 48));
  }
  RecordProperty("edge_pixels", static_cast<int>(edges));
  EXPECT_LE(edges, count / 20 + 1) << "pixels within 1e-9 of an edge, of " << count * 48 * 48;
}

/// A floor of yellow and red squares.
void add_checkered(tracer::Scene& scene, const tracer::Shape& shape, double squares_per_unit) {
  const tracer::CheckerTexture squares{{tracer::Color{0.9, 0.9, 0.1}, {0.9, 0.1, 0.1}}};
  scene.textures = {{.pattern = squares, .scale = {squares_per_unit, squares_per_unit}, .path = {}}};
  scene.textures[0].filter = tracer::Texture::Filter::nearest;
  tracer::Material floor = scenes::matte({0.8, 0.8, 0.8});
  floor.color = tracer::TextureId{0};
  scenes::add(scene, shape, floor);
}

/// A camera before everything that glass does: in a slab, in a sphere, seen through each other and a mirror.
tracer::Scene glass_scene(double ior, bool fresnel) {
  tracer::Scene scene = scenes::empty(64, {{0.3, 0.8, 6}, {0, 0, 0}, {0, 1, 0}, 50});
  scene.background.color = {0.2, 0.4, 0.8};
  scene.ambient = {0.1, 0.1, 0.1};
  scene.lights = {scenes::point_light({3, 5, 4}), scenes::directional_light({1, -2, -1}, {0.3, 0.3, 0.3})};
  tracer::Material glass = scenes::glass(ior);
  glass.fresnel = fresnel;
  glass.reflection = fresnel ? 1 : 0.1;
  glass.transmission = 0.9;
  glass.transmission_color = tracer::Color{0.9, 1, 0.8};
  scenes::add(scene, tracer::Sphere{{0, 0, 0}, 1}, glass);
  scenes::add(scene, tracer::Sphere{{0, 0, 0}, 0.4}, scenes::glass(1 / ior));  // a bubble
  scenes::add(scene, tracer::Sphere{{1.5, 0.2, -1.5}, 0.7}, scenes::mirror(0.9));
  scenes::add(scene, tracer::Sphere{{-1.6, 0.1, 1}, 0.5}, glass);
  // A slab: two planes, their fronts outside.
  scenes::add(scene, tracer::Plane{{0, 0, -3}, {0, 0.1, 1}, {}}, glass);
  scenes::add(scene, tracer::Plane{{0, 0, -3.5}, {0, -0.1, -1}, {}}, glass);
  add_checkered(scene, tracer::Plane{{0, -1, 0}, {0, 1, 0}, {}}, 1);
  scene.accuracy.max_depth = 9;
  return scene;
}

TEST(Image, OfGlassSlabsSpheresAndBubblesEqualsTheReferenceWithAndWithoutFresnel) {
  for (const double ior : {1.5, 0.7, 1.0 + 1e-9, 2.4, 1e6})
    for (const bool fresnel : {true, false}) {
      // Light that leaves such glass takes a millionth of its angle inside: no double holds the image, but Fresnel
      // lets hardly any out.
      if (ior == 1e6 && !fresnel) continue;
      SCOPED_TRACE("ior " + std::to_string(ior) + (fresnel ? " fresnel" : ""));
      EXPECT_LE(expect_reference(glass_scene(ior, fresnel)), 2u);
    }
}

TEST(Image, OfNestedAndOverlappingSolidsEqualsTheReference) {
  for (const int first : {0, 1, 2, 3}) {
    SCOPED_TRACE(first);
    tracer::Scene scene = glass_scene(1.5, true);
    scene.objects.clear();
    const auto add = [&](const tracer::Sphere& sphere, double ior, int priority) {
      tracer::Material material = scenes::glass(ior);
      material.priority = priority;
      material.absorption = {};
      scenes::add(scene, sphere, material);
    };
    add({{0, 0, 0}, 1.4}, 1.5, first);            // a flask
    add({{0, 0, 0}, 1.1}, 1.33, 1);               // of water
    add({{0.3, 0.2, 0.1}, 0.4}, 1, 2);            // with a bubble in it
    add({{1.2, 0.1, 0.3}, 0.8}, 1.8, 3 - first);  // and a ball through its wall
    tracer::Material backdrop = scenes::matte({0.9, 0.6, 0.2});
    scenes::add(scene, tracer::Plane{{0, -1.5, 0}, {0, 1, 0}, {}}, backdrop);
    EXPECT_LE(expect_reference(scene), 8u);
  }
}

TEST(Image, OfRaysWithTwoToTheSixteenthBranchesEqualsTheReference) {
  // Shells that split every ray in two, inside a mirror that lets none out: generations far larger than are traced at
  // once.
  tracer::Scene scene = scenes::empty(effort::cases(100) < 100 ? 1 : 2, {{0, 0.3, 4}, {0.1, 0, 0}, {0, 1, 0}, 30});
  scenes::add(scene, tracer::Sphere{{0, 0, 0}, 10}, scenes::mirror());
  tracer::Material splitter = scenes::mirror(0.5);
  splitter.transmission = 0.5;
  splitter.ior = 1.1;
  splitter.emission = tracer::Color{0.5, 0.6, 0.7};
  const tracer::MaterialId shell = scenes::add(scene, splitter);
  for (const double radius : {1.0, 2.0, 3.0, 5.0, 7.0}) scenes::add(scene, tracer::Sphere{{0.1, 0, 0}, radius}, shell);
  scene.accuracy.max_depth = 17;
  const tracer::RayCounts rays = scenes::render(scene).statistics.rays;
  EXPECT_GT(rays.total(), scene.image.width * scene.image.width * 100'000u)
      << rays.total() << "or the test tests nothing";
  EXPECT_LE(expect_reference(scene, {0x1p-24L, 1e-6L, 1e-9L}), 1u);
}

TEST(Image, IsTheMeanOfTheReferenceOverTheSamplePositions) {
  for (std::uint64_t seed = 5; seed < 5 + effort::cases(10); ++seed) {
    tracer::Scene scene = scenes::random(seed, 16);
    scene.accuracy.samples = 16;
    scene.accuracy.seed = seed;
    const oracle::ReferenceTracer reference(scene);
    tracer::RenderStatistics counted;
    std::vector<oracle::Sample> theirs;
    for (std::uint32_t pixel = 0; pixel < 16 * 16; ++pixel) {
      const std::uint32_t column = pixel % 16, row = pixel / 16;
      oracle::Sample mean;
      for (std::uint32_t s = 0; s < 16; ++s) {
        const tracer::Vec2 at = tracer::pixel_sample(pixel, s, 16, seed);
        const oracle::Sample sample = reference.sample(column + oracle::Real(at.x), row + oracle::Real(at.y), counted);
        mean.radiance = mean.radiance + (1 / 16.0L) * sample.radiance;
        mean.margin = std::fmin(mean.margin, sample.margin);
      }
      theirs.push_back(mean);
    }
    const tracer::Rendered ours = scenes::render(scene);
    const Difference difference = compare(ours.image, theirs, {});
    EXPECT_EQ(difference.wrong, 0u) << "seed " << seed;
    EXPECT_LE(difference.edges, 1u);
    EXPECT_EQ(ours.statistics.samples - ours.statistics.holdout_samples, 16u * 16 * 16);
  }
}

TEST(Image, OfMeshesEqualsTheReferenceUpToFloatVertices) {
  for (const bool smooth : {false, true})
    for (int material = 0; material < 3; ++material) {
      SCOPED_TRACE(std::to_string(material) + (smooth ? " smooth" : " flat"));
      tracer::Scene scene = scenes::empty(48, {{1, 1.5, 5}, {0, 0, 0}, {0, 1, 0}, 40});
      scene.background.color = {0.2, 0.4, 0.8};
      scene.lights = {scenes::point_light({3, 5, 4}), scenes::directional_light({1, -2, -1}, {0.3, 0.3, 0.3})};
      tracer::Material shiny = scenes::matte({0.7, 0.5, 0.3});
      shiny.model = material == 0 ? tracer::Material::Model::phong : tracer::Material::Model::blinn_phong;
      shiny.specular = 0.5;
      shiny.reflection = material == 1 ? 0.5 : 0;
      if (material == 2) shiny = scenes::glass(1.2);
      scenes::add(scene, scenes::placed(scenes::icosphere(1, smooth), 1, {0, 0.2, 0}), shiny);
      add_checkered(scene, tracer::Triangle{{{{-4, -1, 3}, {4, -1, 3}, {0, -1, -6}}}, {}, {}}, 3);
      scene.accuracy.max_depth = 3;
      // 2^-25 in the corners, over facets a quarter wide and up to three bounces.
      EXPECT_LE(expect_reference(scene, {1e-4L, 1e-5L, 1e-5L}), 12u);
    }
}

}  // namespace
