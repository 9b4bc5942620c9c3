#pragma once
/// Rays for the accelerator, and its answers, one value each.

#include <gtest/gtest.h>

#include <limits>
#include <memory>
#include <vector>

#include "tests/support/long_vec.h"
#include "tracer/src/accel/accelerator.h"

namespace tracer {

struct TestRay {
  Vec3 origin, direction;
  double t_max = std::numeric_limits<double>::infinity();
  PrimitiveRef from{};
};

struct TestHit {
  PrimitiveRef primitive;
  double t = 0, u = 0, v = 0;
};

class RayBatch {
 public:
  explicit RayBatch(const std::vector<TestRay>& rays) {
    for (const TestRay& ray : rays) {
      const double values[] = {ray.origin.x,    ray.origin.y,    ray.origin.z,
                               ray.direction.x, ray.direction.y, ray.direction.z};
      for (int i = 0; i < 6; ++i) components_[i].push_back(values[i]);
      t_max_.push_back(ray.t_max);
      from_.push_back(ray.from);
    }
  }

  [[nodiscard]] std::vector<TestHit> intersect(const Accelerator& accelerator, Coherence coherence,
                                               GeometryMask mask = GeometryMask::all) const {
    const std::size_t count = t_max_.size();
    std::vector<PrimitiveRef> primitive(count);
    std::vector<double> t(count), u(count), v(count);
    accelerator.intersect(span(), {primitive.data(), t.data(), u.data(), v.data()}, coherence, mask);
    std::vector<TestHit> hits;
    for (std::size_t i = 0; i < count; ++i) hits.push_back({primitive[i], t[i], u[i], v[i]});
    return hits;
  }

  [[nodiscard]] std::vector<bool> occluded(const Accelerator& accelerator, Coherence coherence) const {
    std::vector<std::uint8_t> blocked(t_max_.size());
    accelerator.occluded(span(), blocked.data(), coherence);
    return {blocked.begin(), blocked.end()};
  }

 private:
  [[nodiscard]] RaySpan span() const {
    const auto& c = components_;
    return {c[0].data(), c[1].data(),   c[2].data(),  c[3].data(),  c[4].data(),
            c[5].data(), t_max_.data(), from_.data(), t_max_.size()};
  }

  std::vector<double> components_[6];
  std::vector<double> t_max_;
  std::vector<PrimitiveRef> from_;
};

inline std::shared_ptr<const Accelerator> built(const GeometrySet& set) {
  RenderControl control;
  auto accelerator = Accelerator::build(set, control);
  EXPECT_TRUE(accelerator.has_value());
  return std::move(*accelerator);
}

/// Spheres that share one geometry.
inline void add_sphere(SphereGeometry& spheres, const Vec3& center, double radius) {
  spheres.x.push_back(center.x);
  spheres.y.push_back(center.y);
  spheres.z.push_back(center.z);
  spheres.radius.push_back(radius);
  spheres.object.push_back(static_cast<std::uint32_t>(spheres.object.size()));
}

inline void add_plane(PlaneGeometry& planes, const Vec3& point, const Vec3& normal) {
  planes.point.push_back(point);
  planes.normal.push_back(normal);
  planes.object.push_back(static_cast<std::uint32_t>(planes.object.size()));
  planes.transmissive.push_back(0);
}

}  // namespace tracer
