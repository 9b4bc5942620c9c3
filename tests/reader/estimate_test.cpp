/// Estimated work and memory of a scene.

#include "api/estimate.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/reader/reading.h"
#include "tests/support/random.h"
#include "tests/support/scenes.h"
#include "tracer/limits.h"
#include "tracer/src/math/vec.h"
#include "tracer/warnings.h"

using namespace reader_tests;

namespace {

/// 10 x 10 pixels of one sphere.
double work(const std::string& accuracy, const std::string& material = "{}", const std::string& lights = "[]") {
  const std::string object = R"([{"type": "sphere", "center": [0,0,0], "radius": 1, "material": )" + material + "}]";
  const api::Document document =
      accepted(document_with(R"("image": {"width": 10, "height": 10}, "accuracy": )" + accuracy + R"(, "objects": )" +
                             object + R"(, "lights": )" + lights));
  return api::estimated_work(document.scene).value_or(-1);
}

/// 100 x 100 pixels without objects.
api::Document empty_with(const std::string& accuracy) {
  return accepted(document_with(R"("image": {"width": 100, "height": 100}, "accuracy": )" + accuracy));
}

constexpr double sphere = 1 + 20'000;  // with the share of the job itself
const std::string exact = R"({"samples": [4, 4]})";
const std::string point = R"({"type": "point", "position": [0,5,0]})";
const std::string rect = R"({"type": "rect", "corner": [0,5,0], "edge_u": [1,0,0], "edge_v": [0,0,1]})";

tracer::Scene scene_of(std::uint32_t width, std::uint32_t height, std::uint32_t samples) {
  tracer::Scene scene;
  scene.image = {width, height, {}};
  scene.accuracy.samples = samples;
  scene.materials.emplace_back();
  return scene;
}

const tracer::Plane ground{.point = {0, -1, 0}, .normal = {0, 1, 0}, .u_axis = {}};

/// Nothing but a camera in front of the origin, with a low resolution and one sample per pixel.
tracer::Scene before_camera(double cutoff, std::uint32_t max_depth) {
  tracer::Scene scene = scenes::empty(18);
  scene.camera.position = {0, 1.2, 4};
  scene.camera.fov_deg = 40;
  scene.accuracy.cutoff = cutoff;
  scene.accuracy.max_depth = max_depth;
  return scene;
}

void add_sphere(tracer::Scene& scene, const tracer::Vec3& center, double radius, bool is_glass = true) {
  scenes::add(scene, tracer::Sphere{.center = center, .radius = radius},
              is_glass ? scenes::glass() : scenes::mirror(0.9));
}

/// Disjoint spheres of glass and mirrors, every other time over a mirror.
tracer::Scene random_spheres(oracle::Random& random) {
  tracer::Scene scene = before_camera(random.chance(0.5) ? 0 : random.chance(0.5) ? 1e-6 : 1e-3, 10);
  if (random.chance(0.5)) scenes::add(scene, ground, scenes::mirror(0.9));
  std::vector<std::pair<tracer::Vec3, double>> added;
  for (int i = 0; i < 40 && added.size() < 5; ++i) {
    const double radius = random.in(0.2, 0.8);
    const tracer::Vec3 center{random.in(-1.2, 1.2), random.in(radius - 1, 0.5), random.in(-1.2, 1.2)};
    const auto touches = [&](const auto& other) { return length(center - other.first) <= radius + other.second; };
    if (std::ranges::any_of(added, touches)) continue;
    added.emplace_back(center, radius);
    add_sphere(scene, center, radius, random.chance(0.7));
  }
  return scene;
}

/// Rays of the mean tree of a camera ray that hits an object.
double traced_rays(const tracer::Scene& scene) {
  tracer::Scene opaque = scene;
  for (tracer::Material& material : opaque.materials) material = scenes::mirror();
  opaque.accuracy.max_depth = 1;
  const tracer::RayCounts rays = scenes::render(scene).statistics.rays;
  const auto hits = static_cast<double>(scenes::render(opaque).statistics.rays.reflection);
  return 1 + static_cast<double>(rays.reflection + rays.refraction) / hits;
}

void expect_predicted(const std::string& name, const tracer::Scene& scene) {
  const double traced = traced_rays(scene), predicted = tracer::predicted_rays(scene);
  EXPECT_LT(predicted, traced * 10) << name;
  EXPECT_GT(predicted, traced / 10) << name;
}

}  // namespace

TEST(PredictedRays, AreWithinAFactorOfTenForRandomSpheres) {
  oracle::Random random(41);
  for (int i = 0; i < 24; ++i) expect_predicted(std::to_string(i), random_spheres(random));
}

TEST(PredictedRays, AreWithinAFactorOfTenForGlassAndMirrorsTogether) {
  for (const double cutoff : {0.0, 1e-3}) {
    for (const std::uint32_t depth : {4, 8, 12}) {
      const std::string name = std::to_string(cutoff) + " " + std::to_string(depth);
      tracer::Scene alone = before_camera(cutoff, depth), over_mirror = alone, nested = alone, row = alone,
                    room = alone;
      add_sphere(alone, {}, 1);
      expect_predicted("alone " + name, alone);
      over_mirror = alone;
      scenes::add(over_mirror, ground, scenes::mirror(0.9));
      expect_predicted("over a mirror " + name, over_mirror);
      for (const auto& [radius, ior] : {std::pair{1.0, 1.5}, {0.7, 1.2}, {0.4, 1.5}})
        scenes::add(nested, tracer::Sphere{.center = {}, .radius = radius}, scenes::glass(ior));
      expect_predicted("nested " + name, nested);
      for (const double x : {-1.0, 0.0, 1.0}) add_sphere(row, {x, 0, 0}, 0.45);
      expect_predicted("row " + name, row);
      add_sphere(room, {}, 1);
      scenes::add(room, tracer::Box{.min = {-3, -3, -5}, .max = {3, 3, 5}}, scenes::mirror(0.9));
      expect_predicted("room " + name, room);
    }
  }
}

TEST(PredictedRays, AreFiniteAtTheLimits) {
  const tracer::Limits limits;
  for (const double cutoff : {0.0, 1e-300, 1.0}) {
    tracer::Scene scene = before_camera(cutoff, limits.max_depth);
    EXPECT_EQ(tracer::predicted_rays(scene), 1) << "without objects";
    for (const double size : {limits.length_min, 1.0, limits.coordinate_max}) {
      add_sphere(scene, {}, size);
      add_sphere(scene, {size, 0, limits.coordinate_max}, size, false);
    }
    scenes::add(scene, ground, scenes::mirror(1e-30));
    for (int i = 0; i < 1000; ++i) add_sphere(scene, {2.0 * i, 0, 0}, 1);
    const double rays = tracer::predicted_rays(scene);
    EXPECT_GE(rays, 1) << cutoff;
    EXPECT_LE(rays, 1e9) << cutoff;
  }
}

TEST(PredictedRays, RaiseTheEstimatedWork) {
  tracer::Scene scene = before_camera(0, 64);
  add_sphere(scene, {}, 1);
  scenes::add(scene, ground, scenes::mirror(0.9));
  const double samples = 18 * 18;
  EXPECT_GT((api::estimated_work(scene).value_or(0) - 20'000) / samples, 300);
  scene.accuracy.cutoff = 1e-3;
  EXPECT_LT((api::estimated_work(scene).value_or(0) - 20'000) / samples, 10);
}

TEST(EstimatedWork, CountsSamplesAndShadowRays) {
  EXPECT_EQ(work(exact), 100 * 4 + sphere);
  EXPECT_EQ(work(exact, "{}", "[" + point + "]"), 100 * 4 * 2 + sphere);
  EXPECT_EQ(work(exact, "{}", "[" + point + "," + point + "]"), 100 * 4 * 3 + sphere);
  EXPECT_EQ(work(exact, "{}", "[" + rect + "]"), 100 * 4 * (1 + 16.0 / 4) + sphere) << "16 points in a pixel";
  EXPECT_EQ(work(R"({"samples": [32, 32]})", "{}", "[" + rect + "]"), 100 * 32 * 2 + sphere);
  EXPECT_EQ(work(exact, "{}", R"([{"type": "point", "position": [0,5,0], "shadows": false}])"), 100 * 4 + sphere);
}

TEST(EstimatedWork, CountsReflectionAndRefraction) {
  EXPECT_EQ(work(exact, R"({"reflection": 0.5})"), 100 * 4 * 1.5 + sphere);
  EXPECT_EQ(work(exact, R"({"transmission": 1})"), 100 * 4 * 3.0 + sphere) << "refraction includes reflection";
}

TEST(EstimatedWork, CountsThePathsOfGlobalLight) {
  const std::string global = R"({"samples": [4, 4], "model": "global"})";
  EXPECT_EQ(work(global), 100 * 4 * 3 + sphere);
  EXPECT_EQ(work(global, R"({"emission": 1})"), 100 * 4 * 5 + sphere) << "rays toward the emitter";
  EXPECT_EQ(work(R"({"target_error": 1, "model": "global"})"), 100 * 900 * 3 + sphere);
}

TEST(EstimatedWork, CountsSamplesExpectedForATargetError) {
  EXPECT_EQ(work(R"({"target_error": 1})"), 100 * 22 + sphere);
  const double fine = work(R"({"target_error": 0.5})"), finer = work(R"({"target_error": 0.25})");
  EXPECT_NEAR((finer - sphere) / (fine - sphere), 2.395, 0.001) << "2 to the power 1.26";
  EXPECT_EQ(work(R"({"target_error": 1, "samples": [30, 50]})"), 100 * 30 + sphere);
  EXPECT_EQ(work(R"({"target_error": 1, "samples": [1, 10]})"), 100 * 10 + sphere);
  EXPECT_EQ(work(R"({"time_budget_ms": 10})"), -1) << "no target error";
}

TEST(EstimatedWork, CountsTheProofOfTheError) {
  const auto proof = [](const std::string& accuracy) {
    const tracer::Scene scene = empty_with(accuracy).scene;
    return api::estimated_proof_rays(scene, api::content_of(scene)).value_or(-1);
  };
  EXPECT_EQ(proof(R"({"samples": [16, 16]})"), 10'000 * (16 + 4));
  EXPECT_EQ(proof(R"({"target_error": 1})"), 10'000 * (22 + 4));
  EXPECT_EQ(proof(R"({"samples": [1, 1]})"), 16'384 + 10'000 * 4) << "a few looks";
  EXPECT_EQ(proof(R"({"time_budget_ms": 10})"), -1) << "it takes a share of the budget";
  EXPECT_EQ(work(R"({"samples": [4, 4], "proof": true})"), work(exact) + 16'384 + 100 * 4);
}

TEST(EstimatedWork, IsLimitedByATimeBudgetWhereTheSpeedIsKnown) {
  const tracer::Scene budget = empty_with(R"({"time_budget_ms": 10})").scene;
  const tracer::Scene fine = empty_with(R"({"time_budget_ms": 10, "target_error": 0.5})").scene;
  EXPECT_DOUBLE_EQ(*api::estimated_work(budget, api::content_of(budget), 1e-7), 100'000);
  EXPECT_DOUBLE_EQ(*api::estimated_work(fine, api::content_of(fine), 1e-7), 100'000);
  EXPECT_EQ(api::estimated_work(fine, api::content_of(fine), 1e-12), api::estimated_work(fine));
}

TEST(EstimatedWork, CountsObjectsAndTriangles) {
  const api::Document document =
      accepted(document_with(R"("image": {"width": 1, "height": 1}, "accuracy": )" + exact + R"(,
      "prototypes": {"p": [{"type": "mesh", "positions": [[0,0,0],[1,0,0],[0,1,0]], "triangles": [[0,1,2],[2,1,0]],
                            "material": {}}]},
      "objects": [{"type": "instance", "of": "p"}, {"type": "instance", "of": "p"}])"));
  EXPECT_EQ(api::estimated_work(document.scene), 4 + 2 + 1 + 2 + 20'000);
  EXPECT_EQ(api::estimated_measure_work({document, {}, 64}), 2 * 64 + 2 + 1 + 2 + 20'000);
}

TEST(EstimatedWork, OfAMeasurementOfModelsIncludesBothReferences) {
  const auto work = [](const std::string& accuracy, const std::vector<std::string>& parameters) {
    return api::estimated_measure_work({empty_with(accuracy), parameters, 64});
  };
  const std::string global = R"({"model": "global"})", whitted = "{}";
  EXPECT_EQ(work(whitted, {}), work(whitted, {"samples"}));
  EXPECT_EQ(work(global, {"samples"}) + work(whitted, {"samples"}), work(whitted, {"model"}));
  EXPECT_EQ(work(global, {}), work(whitted, {"model"}));
}

TEST(EstimatedMemory, OfMeasurementIncludesAdaptiveSamplingAndReferences) {
  const auto bytes = [](const std::string& accuracy, const std::vector<std::string>& parameters = {}) {
    return api::estimated_measure_memory_bytes({empty_with(accuracy), parameters, 64});
  };
  const std::string adapting = R"({"target_error": 1})";
  EXPECT_EQ(bytes(adapting), api::estimated_memory_bytes(empty_with(adapting).scene) + 10'000 * 150);
  EXPECT_EQ(bytes(exact), bytes(adapting));
  EXPECT_EQ(bytes(exact, {"model"}), bytes(adapting) + 10'000 * 150 + (320 << 20));
}

TEST(EstimatedMemory, IncludesThePatchesOfRadiosity) {
  const auto document = [](const std::string& accuracy) {
    return empty_with(R"({"model": "global", )" + accuracy + "}");
  };
  const auto bytes = [&](const std::string& accuracy) {
    return static_cast<double>(api::estimated_memory_bytes(document(accuracy).scene));
  };
  const std::string ambient = R"("approximate": {"interreflection": "ambient"})";
  const std::string radiosity = R"("approximate": {"interreflection": "radiosity"})";
  const std::string gather = R"("approximate": {"interreflection": "gather"})";
  constexpr double mebi = 1 << 20;
  EXPECT_EQ(bytes(ambient), bytes(R"("target_error": 1)"));
  EXPECT_EQ(bytes(radiosity) - bytes(ambient), 320 * mebi);
  EXPECT_EQ(bytes(gather), bytes(radiosity));
  for (const auto& [target, patches] : {std::pair{"1", 320}, {"3.9", 320}, {"4", 64}}) {
    const std::string adapting = std::string(R"("target_error": )") + target + ", ";
    EXPECT_EQ(bytes(adapting + radiosity) - bytes(adapting + ambient), patches * mebi) << target;
    EXPECT_EQ(api::estimated_measure_memory_bytes({document(adapting + radiosity), {}, 64}),
              api::estimated_measure_memory_bytes({document(adapting + ambient), {}, 64}))
        << "radiosity is one of the models";
  }
}

TEST(IsLarge, DependsOnSamplesOfTheRenderedWindow) {
  EXPECT_FALSE(api::is_large({})) << "the default document";
  EXPECT_FALSE(api::is_large(scene_of(2048, 1024, 1)));
  EXPECT_TRUE(api::is_large(scene_of(2048, 1025, 1)));
  EXPECT_TRUE(api::is_large(scene_of(512, 512, 9)));
  tracer::Scene cropped = scene_of(2048, 1024, 4);
  cropped.image.crop = tracer::PixelWindow{0, 0, 512, 1024};
  EXPECT_FALSE(api::is_large(cropped));
}

TEST(IsLarge, DependsOnMaximumSamplesUnlessTheTimeBudgetIsShort) {
  tracer::Scene scene = scene_of(64, 64, 1'000'000);
  scene.accuracy.adaptive = tracer::Adaptive{};
  scene.accuracy.adaptive->samples_max = 512;
  EXPECT_FALSE(api::is_large(scene));
  scene.accuracy.adaptive->samples_max = 513;
  EXPECT_TRUE(api::is_large(scene));
  scene.accuracy.adaptive->time_budget_ms = 2001;
  EXPECT_TRUE(api::is_large(scene));
  scene.accuracy.adaptive->time_budget_ms = 2000;
  EXPECT_FALSE(api::is_large(scene));
}

TEST(IsLarge, DependsOnSamplesExpectedForTheErrorsOfTheImageAndOfTheWorstTile) {
  using Target = std::optional<double>;
  const auto large = [](std::uint32_t width, std::uint32_t height, Target target, Target tile_error = {}) {
    tracer::Scene scene = scene_of(width, height, 1);
    scene.accuracy.adaptive = tracer::Adaptive{target, tile_error, {}};
    return api::is_large(scene);
  };
  EXPECT_FALSE(large(308, 309, 1)) << "22 samples in a pixel";
  EXPECT_TRUE(large(309, 309, 1));
  EXPECT_TRUE(large(308, 309, 0.5));
  EXPECT_FALSE(large(309, 309, 2));
  EXPECT_FALSE(large(308, 309, {}, 3.5)) << "as for a target error of 1";
  EXPECT_TRUE(large(309, 309, {}, 3.5));
  EXPECT_TRUE(large(309, 309, 100, 3.5)) << "both targets have to be reached";
  EXPECT_TRUE(large(309, 309, 1, 100));
  EXPECT_FALSE(large(309, 309, 2, 7));
}

TEST(IsLarge, DependsOnMemory) {
  tracer::Scene scene = scene_of(16, 16, 1);
  tracer::Mesh mesh;
  for (const std::size_t triangles : {1'000'000, 2'000'000}) {
    mesh.triangles.resize(triangles);
    scene.objects.push_back({mesh, {}, {}});
    EXPECT_EQ(api::is_large(scene), triangles == 2'000'000);
  }
}

TEST(IsLarge, IsTrueForMeshFiles) {
  tracer::Mesh of_file;
  of_file.file = tracer::AssetId{0};
  tracer::Scene placed = scene_of(16, 16, 1), prototype = placed;
  placed.objects.push_back({of_file, {}, {}});
  prototype.prototypes.push_back({{{of_file, {}, {}}}, "/prototypes/tree"});
  EXPECT_TRUE(api::is_large(placed));
  EXPECT_TRUE(api::is_large(prototype));
}
