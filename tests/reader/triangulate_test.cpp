#include "tracer/triangulate.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "tracer/src/math/vec.h"

namespace {

using tracer::Vec3;
using Triangles = std::vector<std::array<std::uint32_t, 3>>;

Triangles cut(const std::vector<Vec3>& corners) {
  Triangles triangles;
  EXPECT_TRUE(tracer::triangulate(corners, triangles));
  EXPECT_EQ(triangles.size(), corners.size() - 2);
  return triangles;
}

/// For planar polygons: the triangles wind as the polygon does and their areas add up to its area, which holds only
/// when they cover it without overlap.
void expect_exact_cover(const std::vector<Vec3>& corners) {
  Vec3 whole;  // twice the area, in the direction of the winding
  for (std::size_t i = 0; i < corners.size(); ++i) whole += cross(corners[i], corners[(i + 1) % corners.size()]);
  const double size = length(whole);
  double sum = 0;
  for (const auto& [a, b, c] : cut(corners)) {
    const double part = dot(cross(corners[b] - corners[a], corners[c] - corners[a]), whole) / size;
    EXPECT_GE(part, -1e-12 * size);
    sum += part;
  }
  EXPECT_NEAR(sum, size, 1e-9 * size);
}

/// A polygon without self-intersection: corners around the origin at random distances, turned into the plane of u, v.
std::vector<Vec3> star(std::mt19937& random, int corners, const Vec3& u, const Vec3& v) {
  std::uniform_real_distribution<double> distance(0.1, 1);
  std::vector<Vec3> polygon;
  for (int i = 0; i < corners; ++i) {
    const double angle = 2 * std::numbers::pi * i / corners, r = distance(random);
    polygon.push_back(r * std::cos(angle) * u + r * std::sin(angle) * v);
  }
  return polygon;
}

TEST(Triangulate, ReturnsAFanForConvexPolygons) {
  EXPECT_EQ(cut({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}), (Triangles{{0, 1, 2}, {0, 2, 3}}));
  EXPECT_EQ(cut({{0, 0, 0}, {0, 1, 0}, {0, 0, 1}}), (Triangles{{0, 1, 2}}));
}

TEST(Triangulate, CoversConcavePolygonsExactly) {
  expect_exact_cover({{0, 0, 0}, {2, 0, 0}, {2, 2, 0}, {1, 0.5, 0}, {0, 2, 0}});
  expect_exact_cover({{1, 0.5, 0}, {0, 2, 0}, {0, 0, 0}, {2, 0, 0}, {2, 2, 0}});
  expect_exact_cover({{0, 0, 0}, {3, 0, 0}, {3, 3, 0}, {1, 3, 0}, {1, 2, 0}, {2, 2, 0}, {2, 1, 0}, {0, 1, 0}});
}

TEST(Triangulate, CoversConcavePolygonsInAnyPlaneAndWinding) {
  std::mt19937 random(3);
  const Vec3 axes[][2] = {{{1, 0, 0}, {0, 1, 0}},    {{0, 1, 0}, {1, 0, 0}},   {{0, 1, 0}, {0, 0, 1}},
                          {{0, 0, 1}, {0, 1, 0}},    {{0, 0, 1}, {1, 0, 0}},   {{1, 0, 0}, {0, 0, 1}},
                          {{1, 2, 3}, {-2, 1, 0.5}}, {{-2, 1, 0.5}, {1, 2, 3}}};
  for (const auto& [u, v] : axes) {
    for (int corners = 4; corners < 60; corners += 3) expect_exact_cover(star(random, corners, u, v));
  }
}

TEST(Triangulate, CoversCombsAndSpiralsUpToItsLimit) {
  std::vector<Vec3> comb;
  for (int i = 0; i < 255; ++i) comb.push_back({static_cast<double>(i), i % 2 == 0 ? 0.0 : 10.0, 0});
  comb.push_back({127, -1, 0});
  EXPECT_EQ(comb.size(), tracer::ear_clipping_corners_max);
  expect_exact_cover(comb);
  std::vector<Vec3> spiral;
  for (int i = 0; i < 60; ++i) spiral.push_back({(10 + i) * std::cos(0.3 * i), (10 + i) * std::sin(0.3 * i), 0});
  for (int i = 59; i >= 0; --i) spiral.push_back({(9 + i) * std::cos(0.3 * i), (9 + i) * std::sin(0.3 * i), 0});
  expect_exact_cover(spiral);
}

TEST(Triangulate, KeepsCollinearAndRepeatedCorners) {
  expect_exact_cover({{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {2, 2, 0}, {1, 2, 0}, {0, 2, 0}});
  expect_exact_cover({{0, 0, 0}, {2, 0, 0}, {2, 0, 0}, {2, 2, 0}, {1, 0.5, 0}, {1, 0.5, 0}, {0, 2, 0}});
}

TEST(Triangulate, IsTheSameFarFromTheOrigin) {
  const std::vector<Vec3> dart = {{0, 0, 0}, {2, -1, 0}, {1, 0, 0}, {2, 1, 0}};
  std::vector<Vec3> far_away = dart;
  for (Vec3& corner : far_away) corner += {1e9, -1e9, 1e9};
  EXPECT_EQ(cut(far_away), cut(dart));
}

TEST(Triangulate, SplitsNonPlanarQuads) { EXPECT_EQ(cut({{0, 0, 0}, {1, 0, 0.1}, {1, 1, 0}, {0, 1, 0.1}}).size(), 2u); }

TEST(Triangulate, EndsForSelfIntersectingAndEmptyPolygons) {
  cut({{0, 0, 0}, {1, 1, 0}, {1, 0, 0}, {0, 1, 0}});
  cut({{1, 1, 1}, {1, 1, 1}, {1, 1, 1}, {1, 1, 1}, {1, 1, 1}});
  std::mt19937 random(4);
  std::uniform_real_distribution<double> anywhere(-1, 1);
  for (int i = 0; i < 100; ++i) {
    std::vector<Vec3> tangle(3 + i % 50);
    for (Vec3& corner : tangle) corner = {anywhere(random), anywhere(random), anywhere(random)};
    for (const auto& triangle : cut(tangle))
      for (const std::uint32_t corner : triangle) EXPECT_LT(corner, tangle.size());
  }
}

TEST(Triangulate, RejectsTooFewAndTooManyCorners) {
  Triangles triangles;
  EXPECT_FALSE(tracer::triangulate(std::vector<Vec3>{{0, 0, 0}, {1, 0, 0}}, triangles));
  std::vector<Vec3> star_of_300, circle_of_300;
  for (int i = 0; i < 300; ++i) {
    const double angle = 2 * std::numbers::pi * i / 300;
    circle_of_300.push_back({std::cos(angle), std::sin(angle), 0});
    star_of_300.push_back(circle_of_300.back() * (i % 2 ? 1 : 0.5));
  }
  EXPECT_FALSE(tracer::triangulate(star_of_300, triangles));
  EXPECT_TRUE(triangles.empty());
  EXPECT_TRUE(tracer::triangulate(circle_of_300, triangles));
  EXPECT_EQ(triangles.size(), 298u);
}

}  // namespace
