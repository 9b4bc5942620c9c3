#include "api/report.h"

#include <gtest/gtest.h>

#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "tracer/version.h"

namespace {

/// A scene of 4 x 2 pixels.
tracer::Scene small_scene() {
  tracer::Scene scene;
  scene.image = {4, 2};
  return scene;
}

TEST(Report, HasNullForTargetsAndBoundsThatDoNotExist) {
  const std::string report = api::write_report(small_scene(), {}, {}, {}, {}, 0);
  EXPECT_NE(
      report.find(R"("proven":null,"confidence":0.95,"target":null,"met":true,"worst_tile":0.0,"tile_target":null,)"
                  R"("bounded":true,"looks":0,"limit":null)"),
      std::string::npos)
      << report;
}

TEST(Report, AcceptsObjectsOfLimitedDepthAndSizeOnly) {
  EXPECT_TRUE(api::read_report("{}"));
  EXPECT_TRUE(api::read_report(api::write_report(small_scene(), {}, {}, {}, {}, 0)));
  const auto nested = [](std::size_t depth) {
    return R"({"a":)" + std::string(depth - 1, '[') + std::string(depth - 1, ']') + "}";
  };
  EXPECT_FALSE(api::read_report(nested(16)).value().of_render);
  const std::string large = R"({"a":")" + std::string(api::report_bytes_max, 'x') + R"("})";
  for (const std::string& text :
       std::vector<std::string>{"", "[]", "{", "{} {}", "{\"a\":\"\xff\"}", nested(17), nested(100'000), large})
    EXPECT_FALSE(api::read_report(text)) << text.substr(0, 20);
}

TEST(Report, MembersOfOtherTypesCountAsZero) {
  for (const char* const other : {"5", "[1]", "\"text\"", "true", "-1e300", "1e300", "{\"camera\": \"x\"}"}) {
    const std::string value(other);
    std::string report = R"({"estimated_work": 1)";
    for (const char* const member : {"rays", "error", "textures", "time_ms"})
      report.append(R"(, ")").append(member).append(R"(": )").append(value);
    report.append(R"(, "geometry_reused": )").append(value == "true" ? "1" : value).append("}");
    const auto figures = api::read_report(report);
    ASSERT_TRUE(figures) << report;
    EXPECT_EQ(figures->rays.camera, 0u) << report;
    EXPECT_FALSE(figures->cache_hits.geometry) << report;
    EXPECT_EQ(figures->target_met, std::nullopt) << report;
  }
  const auto huge =
      api::read_report(R"({"rays": {"camera": 1e300, "shadow": -5}, "error": {"target": 1, "met": "x"}})");
  EXPECT_EQ(huge->rays.camera, std::uint64_t{1} << 63);
  EXPECT_EQ(huge->rays.shadow, 0u);
  EXPECT_EQ(huge->target_met, false);
}

TEST(Report, WritesTheShortestDigitsOfNumbers) {
  const std::vector<std::pair<double, std::string>> texts{{0, "0.0"},
                                                          {-0.0, "-0.0"},
                                                          {1.0 / 3, "0.3333333333333333"},
                                                          {1e-4, "0.0001"},
                                                          {9.999e-5, "9.999e-05"},
                                                          {5e-324, "5e-324"},
                                                          {999999999999999, "999999999999999.0"},
                                                          {1e15, "1e+15"},
                                                          {-1.5e300, "-1.5e+300"},
                                                          {std::numeric_limits<double>::infinity(), "null"}};
  for (const auto& [number, text] : texts) {
    tracer::ErrorEstimate error;
    error.estimate = number;
    const std::string report = api::write_report({}, error, {}, {}, {}, 0);
    EXPECT_NE(report.find(R"("estimate":)" + text + ","), std::string::npos) << report;
  }
}

TEST(Report, HasEveryMember) {
  tracer::Scene scene = small_scene();
  tracer::Material& glass = scene.materials.emplace_back();
  glass.transmission = 1;
  glass.color = tracer::Color{};
  glass.fresnel = true;
  glass.path = "/materials/glass";
  scene.objects.push_back({tracer::Sphere{}, {0}, {}});
  tracer::RenderStatistics statistics;
  statistics.rays = {72, 10, 20, 30, 40};
  statistics.samples = 80;
  statistics.samples_min = 2;
  statistics.samples_max = 23;
  statistics.holdout_samples = 8;
  statistics.non_finite = 3;
  statistics.duplicates = 11;
  statistics.culled_shadow_rays = 144;
  scene.accuracy.cutoff = 1e-3;
  statistics.culled_radiance = 80 << 19;  // half of the cutoff in every sample
  tracer::ErrorEstimate error;
  error.estimate = 1.5;
  error.confidence = 0.75;
  error.target = 1;
  error.target_met = false;
  error.sampling = 0.5;
  error.depth = 0.25;
  error.cutoff = 0.125;
  error.approximation = 0.0625;
  error.approximation_min = 0.015625;
  error.bounded = false;
  error.proven = 1.75;
  error.worst_tile = 6.5;
  error.tile_target = 7;
  error.tone = 0.03125;
  error.looks = 1234;
  error.limit = tracer::ErrorEstimate::Limit::time_budget;
  const std::vector<api::ReportedArtifact> artifacts{
      {"image.png", {.estimate = 2, .proven = 2.25, .worst_tile = 7.5, .encoding = 0.5, .target_met = false}},
      {"image.exr", {.estimate = 1.5, .proven = std::numeric_limits<double>::infinity()}}};
  const std::string expected =
      R"({"requirements":{"reflection":true,"refraction":true,"fresnel":true,"shadows":false,"transmissive_shadows":false,)"
      R"("transmitted_light":false,)"
      R"("soft_lights":false,"many_lights":false,"absorption":false,"overlapping_media":false,"gouraud":false,)"
      R"("lens":false,"depth_cue":false,"layers":false,"environment":false,"textures":false,"filtered_textures":false,)"
      R"("bump":false,"smooth_normals":false,"triangles":false,"spheres":true,"quadrics":false,"planes":false,"global_light":false,"emitters":false,"principled":false,"interreflection":false,"approximations":false},)"
      R"("reasons":{"reflection":"/materials/glass","refraction":"/materials/glass","fresnel":"/materials/glass",)"
      R"("spheres":"/objects/0"},)"
      R"("warnings":[{"pointer":"#/lights","code":"nothing_lit","detail":"every object is black: there is no light, no \"ambient\" and no \"emission\""}],)"
      R"("error":{"estimate":1.5,"proven":1.75,"confidence":0.75,"target":1.0,"met":false,"worst_tile":6.5,)"
      R"("tile_target":7.0,"bounded":false,"looks":1234,"limit":"time_budget",)"
      R"("parts":{"sampling":0.5,"depth":0.25,"cutoff":0.125,"approximation":0.0625,"approximation_min":0.015625,"tone":0.03125}},)"
      R"("artifacts":[{"name":"image.png","error":{"estimate":2.0,"proven":2.25,"met":false,"worst_tile":7.5,"encoding":0.5}},)"
      R"({"name":"image.exr","error":{"estimate":1.5,"proven":null,"met":true,"worst_tile":0.0,"encoding":0.0}}],)"
      R"("samples":{"min":2,"mean":9.0,"max":23},"holdout_samples":8,"rays":{"camera":72,"shadow":10,"reflection":20,"refraction":30,"diffuse":40},"culled_shadows":{"rays":144,"radiance":0.0005},"duplicates":11,)"
      R"("time_ms":{"queue":0.5,"parse":1.0,"build":2.0,"trace":3.0,"encode":4.0},"workers":1,"tasks":0,"repeated_tasks":0,"geometry_reused":true,"textures":{"reused":5,"decoded":6},"radiosity":{"patches":7,"limited":true,"stages":12,"rays":8,"factors":9,"sweeps":10,"reused":true,"bound":null},"estimated_work":20097.0,"memory_bytes":12345678901,"non_finite":3,)"
      R"("build":")" +
      std::string(tracer::build()) + "\"}";
  const tracer::RadiosityFigures radiosity{7, true, 12, 8, 9, 10, std::numeric_limits<double>::infinity()};
  const api::StageTimes times{0.5, 1, 2, 3, 4, {true, 5, 6, true}, radiosity};
  EXPECT_EQ(api::write_report(scene, error, artifacts, statistics, times, 12345678901), expected);
}

}  // namespace
