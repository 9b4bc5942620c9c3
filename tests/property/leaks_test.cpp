// No ray passes through a closed mesh at its edges and vertices.
#include "tests/support/leaks.h"

#include <gtest/gtest.h>

#include <iostream>

#include "tests/support/effort.h"
#include "tests/support/scenes.h"
#include "tracer/src/compiled/compiled_scene.h"

namespace {

using namespace tracer;

TriangleGeometry compiled(const Mesh& mesh) {
  Scene scene = scenes::empty(1);
  scenes::add(scene, mesh, scenes::matte({1, 1, 1}));
  RenderControl control;
  return (*compile(scene, control))->geometry().triangles[0];
}

struct Case {
  const char* name;
  Mesh mesh;
};

TEST(ClosedMeshes, LeakNoRaysAimedAtTheirEdgesAndVertices) {
  const Case cases[] = {{"icosahedron", scenes::icosphere(0)},       {"sphere of 320", scenes::icosphere(2)},
                        {"sphere of 20,480", scenes::icosphere(5)},  {"sphere of 327,680", scenes::icosphere(7)},
                        {"torus", scenes::torus(300, 100)},          {"box", leaks::box()},
                        {"lathe of 30 x 30", leaks::lathe(30, 30)},  {"lathe of 500 x 2", leaks::lathe(500, 2)},
                        {"lathe of 3 x 5000", leaks::lathe(3, 5000)}};
  leaks::Count total;
  for (const auto& [name, mesh] : cases)
    for (const leaks::CameraRay generate_ray : {leaks::CameraRay::vertices, leaks::CameraRay::edges}) {
      const TriangleGeometry geometry = compiled(mesh);
      const leaks::Count found = leaks::count(geometry, generate_ray, effort::cases(40'000), 1);
      std::cout << found.leaked << " of " << found.rays << " rays aimed at "
                << (generate_ray == leaks::CameraRay::vertices ? "vertices" : "edges") << " of the " << name
                << " leaked\n";
      total += found;
    }
  EXPECT_EQ(total.leaked, 0u) << "of " << total.rays;
}

}  // namespace
