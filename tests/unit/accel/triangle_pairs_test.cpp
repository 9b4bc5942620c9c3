// Grouping of triangles to pairs; no hit depends on it.
#include "tracer/src/accel/triangle_pairs.h"

#include <algorithm>
#include <set>

#include "tests/support/effort.h"
#include "tests/support/random.h"
#include "tests/unit/accel/ray_batch.h"

namespace tracer {
namespace {

using oracle::Random;
using oracle::Real;
using oracle::Vec;

/// A rough sheet of 2 * side * side triangles over the unit square; the halves of a cell are neighbors in the list.
TriangleGeometry sheet(Random& random, std::uint32_t side) {
  TriangleGeometry geometry;
  for (std::uint32_t j = 0; j <= side; ++j)
    for (std::uint32_t i = 0; i <= side; ++i)
      geometry.positions.push_back(
          {i / static_cast<double>(side) - 0.5, random.in(-0.05, 0.05), j / static_cast<double>(side) - 0.5});
  for (std::uint32_t j = 0; j < side; ++j)
    for (std::uint32_t i = 0; i < side; ++i) {
      const std::uint32_t a = j * (side + 1) + i, b = a + 1, c = a + side + 1, d = c + 1;
      geometry.triangles.push_back({a, c, b});
      geometry.triangles.push_back({d, b, c});
    }
  return geometry;
}

/// The triangles in random order, so that few neighbors in the list share an edge; `was` are their positions before.
TriangleGeometry shuffled(Random& random, TriangleGeometry geometry, std::vector<std::uint32_t>& was) {
  const auto count = static_cast<std::uint32_t>(geometry.triangles.size());
  for (std::uint32_t i = 0; i < count; ++i) was.push_back(i);
  for (std::uint32_t i = count - 1; i > 0; --i) {
    const std::uint32_t other = random.below(i + 1);
    std::swap(geometry.triangles[i], geometry.triangles[other]);
    std::swap(was[i], was[other]);
  }
  return geometry;
}

/// Number of triangles in pairs. Expects that each triangle is in one group, and that pairs share two corners.
std::size_t in_pairs(const TriangleGeometry& geometry) {
  std::vector<int> occurrences(geometry.triangles.size(), 0);
  std::size_t paired = 0;
  for (const TrianglePair& one : triangle_pairs(geometry)) {
    ++occurrences.at(one.first);
    if (!one.pair()) continue;
    ++occurrences.at(one.second);
    paired += 2;
    std::set<std::uint32_t> corners;
    for (const std::uint32_t triangle : {one.first, one.second})
      corners.insert(geometry.triangles[triangle].begin(), geometry.triangles[triangle].end());
    EXPECT_LE(corners.size(), 4u) << one.first << " and " << one.second;
  }
  EXPECT_EQ(std::count(occurrences.begin(), occurrences.end(), 1), static_cast<std::ptrdiff_t>(occurrences.size()));
  return paired;
}

TEST(TrianglePairs, JoinNeighborsInTheListThatShareAnEdge) {
  TriangleGeometry geometry;
  geometry.positions = {{0, 2, 0}, {1, 2, 0}, {1, 1, 0}, {0, 0, 0}, {0, 1, 0}, {1, 0, 0},
                        {2, 1, 0}, {2, 0, 0}, {5, 5, 0}, {6, 5, 0}, {5, 6, 0}};
  geometry.triangles = {{0, 1, 2}, {3, 4, 2}, {3, 2, 5}, {2, 5, 6}, {6, 5, 7}, {8, 9, 10}};
  EXPECT_EQ(triangle_pairs(geometry),
            (std::vector<TrianglePair>{{0, TrianglePair::none}, {1, 2}, {3, 4}, {5, TrianglePair::none}}));
}

TEST(TrianglePairs, JoinTrianglesAnywhereInTheList) {
  Random random(11);
  std::vector<std::uint32_t> was;
  const TriangleGeometry cells = sheet(random, 40);
  EXPECT_EQ(in_pairs(cells), cells.triangles.size());
  EXPECT_GT(in_pairs(shuffled(random, cells, was)), cells.triangles.size() / 10 * 9);
  TriangleGeometry halves = cells;  // first one half of every cell, then the others
  std::stable_partition(halves.triangles.begin(), halves.triangles.end(),
                        [](const auto& corners) { return corners[2] == corners[0] + 1; });
  EXPECT_EQ(in_pairs(halves), halves.triangles.size());
}

TEST(TrianglePairs, DoNotJoinTrianglesWhoseBoxIsMostlyEmpty) {
  TriangleGeometry geometry;
  geometry.positions = {{0, 0, 0}, {1, 0, 0}, {1, 0.1, 0}, {1, 0, 0.3}};
  geometry.triangles = {{0, 1, 2}, {1, 2, 3}};
  EXPECT_EQ(in_pairs(geometry), 0u);
  geometry.positions[3] = {0, 0.1, 0};  // the other half of the face
  geometry.triangles[1] = {0, 2, 3};
  EXPECT_EQ(in_pairs(geometry), 2u);
}

TEST(TrianglePairs, JoinTheNeighborsThatFillTheirBoxBest) {
  TriangleGeometry strip;  // a row of right angles; in the list, only those across upright edges are neighbors
  strip.positions = {{0, 0, 0}, {0, 1, 0}, {1, 0, 0}, {1, 1, 0}, {2, 0, 0}, {2, 1, 0}};
  strip.triangles = {{2, 3, 4}, {8, 8, 8}, {0, 1, 2}, {8, 8, 8}, {3, 4, 5}, {8, 8, 8}, {1, 2, 3}};
  strip.positions.resize(9, {3, 3, 3});
  const auto pairs = triangle_pairs(strip);
  EXPECT_EQ(std::count(pairs.begin(), pairs.end(), TrianglePair{0, 4}), 1);
  EXPECT_EQ(std::count(pairs.begin(), pairs.end(), TrianglePair{2, 6}), 1);
}

TEST(TrianglePairs, AreEmptyWithoutTriangles) { EXPECT_TRUE(triangle_pairs({}).empty()); }

TEST(TrianglePairs, AreIncompleteAfterCancellation) {
  Random random(3);
  const TriangleGeometry geometry = sheet(random, 40);
  RenderControl control;
  control.cancel();
  EXPECT_TRUE(triangle_pairs(geometry, control).empty());
  EXPECT_FALSE(triangle_pairs(geometry).empty());
}

TEST(TrianglePairs, DoNotJoinDegenerateTriangles) {
  TriangleGeometry geometry;
  geometry.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  geometry.triangles = {{0, 1, 1}, {0, 1, 2}, {2, 2, 2}, {1, 1, 0}};
  EXPECT_EQ(in_pairs(geometry), 0u);
}

TEST(TrianglePairs, TakeLinearTimeForTrianglesThatShareAFewVertices) {
  Random random(12);
  constexpr std::uint32_t count = 300'000;
  TriangleGeometry fan, crowd;  // a search of all triangles around a vertex would take 10^10 steps
  fan.positions.push_back({0, 0.3, 0});
  for (std::uint32_t i = 0; i <= count; ++i) {
    const double turn = 6.28 * i / count;
    fan.positions.push_back({std::cos(turn), 0, std::sin(turn)});
    if (i > 0) fan.triangles.push_back({0, i, i + 1});
  }
  std::vector<std::uint32_t> was;
  in_pairs(shuffled(random, fan, was));
  for (int i = 0; i < 12; ++i) crowd.positions.push_back(random.vector(1));
  while (crowd.triangles.size() < count)
    crowd.triangles.push_back({random.below(4), 4 + random.below(4), 8 + random.below(4)});
  in_pairs(crowd);
}

TEST(TrianglePairs, AreHitByRaysThatStartOnTheOtherTriangle) {
  TriangleGeometry valley;
  valley.positions = {{0, 0, 0}, {0, 0, 0.4}, {0.3, 0.3, 0.2}, {-0.3, 0.3, 0.2}};
  valley.triangles = {{0, 1, 2}, {1, 0, 3}};
  ASSERT_EQ(triangle_pairs(valley).size(), 1u);
  GeometrySet set;
  set.triangles.push_back(valley);
  const auto accelerator = built(set);
  Random random(6);
  std::vector<TestRay> rays;
  std::vector<std::uint32_t> to;
  const auto on_side = [&](std::uint32_t side) {
    const Real v = random.in(0.1, 0.9), along = random.in(0.1, 0.9);
    const Vec bottom(0, 0, 0.4L * along), corner = valley.position(2 + side);
    return (1 - v) * bottom + v * corner;
  };
  for (std::uint64_t i = 0; i < effort::cases(20'000); ++i) {
    const std::uint32_t from = random.below(2);
    const Vec start = on_side(from), end = on_side(1 - from);
    rays.push_back({rounded(start), rounded(unit(end - start)), HUGE_VAL, {0, from}});
    to.push_back(1 - from);
  }
  const auto hits = RayBatch(rays).intersect(*accelerator, Coherence::incoherent);
  const auto blocked = RayBatch(rays).occluded(*accelerator, Coherence::coherent);
  for (std::size_t i = 0; i < rays.size(); ++i) {
    ASSERT_EQ(hits[i].primitive, (PrimitiveRef{0, to[i]}));
    ASSERT_TRUE(blocked[i]);
  }
}

TEST(TrianglePairs, ChangeNoHit) {
  Random random(5);
  GeometrySet ordered, mixed;
  std::uint64_t others = 0;
  std::vector<std::uint32_t> was;
  ordered.triangles.push_back(sheet(random, 40));
  mixed.triangles.push_back(shuffled(random, ordered.triangles[0], was));
  for (const TrianglePair& one : triangle_pairs(mixed.triangles[0]))
    if (one.pair()) others += was[one.first] / 2 != was[one.second] / 2 ? 1 : 0;
  ASSERT_GT(others, 10u) << "pairs across cells";
  std::vector<TestRay> rays;
  while (rays.size() < effort::cases(40'000)) {
    const Vec d = random.direction(), target = random.vector(0.5);
    TestRay ray{rounded(Vec(target.x, 0, target.z) - static_cast<Real>(random.in(0, 2)) * d), rounded(d)};
    if (random.chance(0.3)) ray.t_max = random.in(0, 3);
    rays.push_back(ray);
  }
  const auto in_order = built(ordered), in_disorder = built(mixed);
  const RayBatch batch(rays);
  std::uint64_t hits = 0;
  for (const Coherence coherence : {Coherence::coherent, Coherence::incoherent}) {
    const auto expected = batch.intersect(*in_order, coherence), found = batch.intersect(*in_disorder, coherence);
    EXPECT_EQ(batch.occluded(*in_order, coherence), batch.occluded(*in_disorder, coherence));
    for (std::size_t i = 0; i < rays.size(); ++i) {
      ASSERT_EQ(found[i].primitive.hit(), expected[i].primitive.hit());
      if (!found[i].primitive.hit()) continue;
      ++hits;
      ASSERT_EQ(found[i].t, expected[i].t);
      ASSERT_EQ(was[found[i].primitive.primitive], expected[i].primitive.primitive);
      ASSERT_EQ(found[i].u, expected[i].u);
    }
  }
  EXPECT_GT(hits, rays.size() / 2);
}

}  // namespace
}  // namespace tracer
