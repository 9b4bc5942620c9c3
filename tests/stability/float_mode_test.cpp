// The image does not depend on the caller's flush-to-zero mode.
#include <gtest/gtest.h>
#include <immintrin.h>

#include "tests/stability/table.h"
#include "tests/support/effort.h"

namespace {

using namespace tracer;
using stability::Oracle;
using stability::Row;

/// Sets FTZ and DAZ on this thread during its lifetime.
class Flushing {
 public:
  Flushing() : before_(_mm_getcsr()) { _mm_setcsr(before_ | 0x8040U); }
  ~Flushing() { _mm_setcsr(before_); }
  Flushing(const Flushing&) = delete;
  Flushing& operator=(const Flushing&) = delete;

 private:
  unsigned before_;
};

/// A scene in units of `size`, with mirrors whose throughput underflows.
Scene fading(std::uint64_t seed, double size) {
  Scene scene = scenes::random(seed, 40);
  for (Object& object : scene.objects)
    object.transform = Transform{{{{size, 0, 0, 0}, {0, size, 0, 0}, {0, 0, size, 0}}}};
  const auto times = [size](const Vec3& v) { return Vec3{v.x * size, v.y * size, v.z * size}; };
  scene.camera.position = times(scene.camera.position);
  scene.camera.look_at = times(scene.camera.look_at);
  for (Light& light : scene.lights)
    if (auto* point = std::get_if<PointLight>(&light.source)) point->position = times(point->position);
  scene.accuracy.cutoff = 0;
  scenes::add(scene, scenes::placed(scenes::icosphere(2, true), 0.8 * size, {0, 0, 0}), scenes::mirror(1e-30));
  return scene;
}

TEST(FlushingDenormals, ChangesNoBitOfAnImage) {
  Row row(20, "denormals flushed to zero, or not: the same bits", Oracle::invariance, "pixels");
  for (std::uint64_t seed = 1; seed <= effort::cases(10); ++seed)
    for (const double size : {1e-50, 1.0, 1e50})
      for (const std::uint32_t threads : {1u, 2u}) {
        const Scene scene = fading(seed, size);
        const Image expected = stability::render(scene, threads).image;
        const Flushing flushing;
        stability::compare(row, stability::render(scene, threads).image, expected,
                           "seed " + std::to_string(seed) + " size " + std::to_string(size));
      }
}

}  // namespace
