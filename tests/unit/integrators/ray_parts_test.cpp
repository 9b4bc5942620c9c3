// Parts of a queue of rays, between which a render can be cancelled.
#include <gtest/gtest.h>

#include <vector>

#include "tracer/src/integrators/whitted/wavefront_state.h"

namespace tracer {
namespace {

struct Rays {
  explicit Rays(std::size_t count) : values(count), from(count) {}
  [[nodiscard]] RaySpan span() const {
    const double* v = values.data();
    return {v, v, v, v, v, v, v, from.data(), values.size()};
  }
  std::vector<double> values;
  std::vector<PrimitiveRef> from;
};

TEST(PartsOfRays, EndAfterACancellation) {
  RenderControl control;
  const Rays rays(16384);
  std::size_t traced = 0;
  for_each_part(rays.span(), control, [&](const RaySpan& part, std::size_t) {
    traced += part.count;
    if (traced >= 1000) control.cancel();
  });
  EXPECT_LT(traced, 2000u);
}

}  // namespace
}  // namespace tracer
