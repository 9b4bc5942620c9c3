// The division of surfaces into patches.
#include "tracer/src/radiosity/patches.h"

#include <gtest/gtest.h>

namespace {

using namespace tracer;

constexpr Vec2 no_offset{0.5, 0.5};

TEST(PatchGrid, KeepsObjectsSidesAndCellsApart) {
  PatchGrid grid(1);
  const std::uint32_t first = grid.insert(0, {0.1, 0.1, 0}, {0, 0, 1});
  EXPECT_EQ(grid.insert(0, {0.2, 0.3, 0}, {0, 0, 1}), first);
  EXPECT_EQ(grid.insert(1, {0.1, 0.1, 0}, {0, 0, 1}), 1u);
  EXPECT_EQ(grid.insert(0, {0.1, 0.1, 0}, {0, 0, -1}), 2u);
  EXPECT_EQ(grid.insert(0, {1.1, 0.1, 0}, {0, 0, 1}), 3u);
  EXPECT_EQ(grid.insert(0, {0.1, 0.1, 0}, normalize(Vec3{0.5, 0, 1})), 4u);
  EXPECT_EQ(grid.size(), 5u);
  EXPECT_EQ(grid.find(0, {0.3, 0.2, 0}, {0, 0, 1}, no_offset), first);
  EXPECT_EQ(grid.find(2, {0.3, 0.2, 0}, {0, 0, 1}, no_offset), PatchGrid::none);
}

TEST(PatchGrid, InterpolatesBetweenPatchesInTheMean) {
  PatchGrid grid(1);
  for (int x = -2; x <= 2; ++x)
    for (int y = -2; y <= 2; ++y) grid.insert(0, {x + 0.13, y + 0.13, 0}, {0, 0, 1});
  // A tenth of a cell from the border, the choices from half a cell to a tenth of one on this side stay.
  const double border = 0.63;
  const std::uint32_t left = grid.find(0, {border - 0.1, 0.13, 0}, {0, 0, 1}, no_offset);
  int beyond = 0;
  constexpr int choices = 1000;
  for (int i = 0; i < choices; ++i)
    beyond += grid.find(0, {border - 0.1, 0.13, 0}, {0, 0, 1}, {(i + 0.5) / choices, 0.5}) != left ? 1 : 0;
  EXPECT_EQ(beyond, 400);
}

TEST(PatchGrid, StaysOnTheSurfaceWhereNoPatchIsBeside) {
  PatchGrid grid(1);
  const std::uint32_t only = grid.insert(0, {0.1, 0.1, 0}, {0, 0, 1});
  for (const Vec2 xi : {Vec2{0, 0}, Vec2{0.99, 0}, Vec2{0.99, 0.99}})
    EXPECT_EQ(grid.find(0, {0.1, 0.1, 0}, {0, 0, 1}, xi), only);
}

}  // namespace
