// Solids, open surfaces and surfaces without a medium.
#include "tracer/src/scene/medium_boundary.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/random.h"
#include "tests/support/scenes.h"

namespace tracer {
namespace {

Material material_of(Material::Transparency transparency, double ior, const Color& absorption = {}) {
  Material material;
  material.transmission = 0.5;
  material.transparency = transparency;
  material.ior = ior;
  material.absorption = absorption;
  return material;
}

bool is_closed(const Shape& shape) {
  return medium_boundary(shape, material_of(Material::Transparency::refract, 1.5)) == MediumBoundary::closed;
}

TEST(MediumBoundary, IsClosedForShapesWithoutABorder) {
  Cylinder tube;
  Cone funnel;
  EXPECT_TRUE(is_closed(tube) && is_closed(funnel));
  tube.caps = funnel.caps = false;
  EXPECT_FALSE(is_closed(tube) || is_closed(funnel));
  for (const Shape& solid : {Shape(Sphere{}), Shape(Box{}), Shape(Torus{}), Shape(Plane{})})
    EXPECT_TRUE(is_closed(solid)) << solid.index();
  for (const Shape& sheet : {Shape(Disc{}), Shape(Triangle{})}) EXPECT_FALSE(is_closed(sheet)) << sheet.index();
}

TEST(MediumBoundary, IsOpenForAMeshWithAMissingOrATurnedTriangle) {
  for (const Mesh& whole : {scenes::icosphere(2), scenes::torus(12, 8)}) {
    EXPECT_TRUE(is_closed(whole));
    for (std::size_t i = 0; i < whole.triangles.size(); ++i) {
      Mesh torn = whole, turned = whole;
      torn.triangles.erase(torn.triangles.begin() + static_cast<std::ptrdiff_t>(i));
      std::swap(turned.triangles[i][0], turned.triangles[i][1]);
      ASSERT_FALSE(is_closed(torn)) << i;
      ASSERT_FALSE(is_closed(turned)) << i;
    }
  }
}

TEST(MediumBoundary, JoinsCornersAtEqualPositionsInAnyOrder) {
  oracle::Random random(5);
  Mesh mesh = scenes::icosphere(1);
  mesh.positions.push_back(mesh.positions[mesh.triangles[0][0]]);
  mesh.triangles[0][0] = static_cast<std::uint32_t>(mesh.positions.size() - 1);
  for (int i = 0; i < 20; ++i) {
    std::swap(mesh.triangles[random.below(80)], mesh.triangles[random.below(80)]);
    auto& corners = mesh.triangles[random.below(80)];
    std::rotate(corners.begin(), corners.begin() + 1, corners.end());
    EXPECT_TRUE(is_closed(mesh));
  }
  Mesh inverted = mesh;
  for (auto& corners : inverted.triangles) std::swap(corners[0], corners[1]);
  EXPECT_TRUE(is_closed(inverted));
  mesh.positions.back().x += 1e-12;
  EXPECT_FALSE(is_closed(mesh));
}

TEST(MediumBoundary, NeedsRefractionOrAVolumeThatAbsorbs) {
  using enum Material::Transparency;
  using enum MediumBoundary;
  const Color dark{0, 1, 0};
  struct Case {
    Material material;
    MediumBoundary solid, sheet;
  };
  for (const Case& each :
       {Case{material_of(refract, 1.5), closed, open}, Case{material_of(refract, 1), closed, none},
        Case{material_of(refract, 1, dark), closed, open}, Case{material_of(filtered, 1.5), none, none},
        Case{material_of(filtered, 1.5, dark), closed, none}, Case{material_of(interpolated, 1.5), none, none},
        Case{material_of(interpolated, 1.5, dark), closed, none}, Case{Material{}, none, none}}) {
    EXPECT_EQ(medium_boundary(Sphere{}, each.material), each.solid);
    EXPECT_EQ(medium_boundary(Disc{}, each.material), each.sheet);
  }
}

}  // namespace
}  // namespace tracer
