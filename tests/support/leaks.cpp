#include "tests/support/leaks.h"

#include <numbers>
#include <stdexcept>

#include "tests/support/random.h"
#include "tracer/src/accel/accelerator.h"

namespace leaks {
namespace {

using oracle::Random;
using oracle::Real;
using oracle::Vec;
using tracer::TriangleGeometry;
using tracer::Vec3;

using Around = std::vector<std::vector<std::uint32_t>>;  // triangles of each vertex

Around triangles_around(const TriangleGeometry& mesh) {
  Around around(mesh.positions.size());
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t)
    for (const std::uint32_t vertex : mesh.triangles[t]) around[vertex].push_back(t);
  return around;
}

Vec area(const TriangleGeometry& mesh, std::uint32_t triangle) {
  const auto& [a, b, c] = mesh.triangles[triangle];
  const Vec pa = mesh.position(a);
  return cross(Vec(mesh.position(b)) - pa, Vec(mesh.position(c)) - pa);
}

struct Target {
  Vec point;
  std::vector<std::uint32_t> triangles;  ///< adjacent triangles
};

Target random_target(const TriangleGeometry& mesh, const Around& around, CameraRay generate_ray, Random& random) {
  const auto& corners = mesh.triangles[random.below(static_cast<std::uint32_t>(mesh.triangles.size()))];
  const std::uint32_t first = random.below(3), a = corners[first], b = corners[(first + 1) % 3];
  if (generate_ray == CameraRay::vertices) return {mesh.position(a), around[a]};
  Target target{Vec(mesh.position(a)) + Real(random.in(0, 1)) * (Vec(mesh.position(b)) - mesh.position(a)), {}};
  for (const std::uint32_t t : around[a])
    for (const std::uint32_t vertex : mesh.triangles[t])
      if (vertex == b) target.triangles.push_back(t);
  return target;
}

/// True if all triangles have the same orientation towards the ray, and none is edge-on within rounding.
bool closed_to(const TriangleGeometry& mesh, const Target& target, const Vec& direction) {
  int fronts = 0;
  for (const std::uint32_t t : target.triangles) {
    const Vec n = area(mesh, t);
    const Real cosine = dot(n, direction) / length(n);
    if (!(std::fabs(cosine) > 1e-9L)) return false;
    fronts += cosine < 0 ? 1 : 0;
  }
  return fronts == 0 || fronts == static_cast<int>(target.triangles.size());
}

/// Rays for the accelerator with their maximum distances.
struct Batch {
  std::vector<double> ox, oy, oz, dx, dy, dz;
  std::vector<Real> reach;

  void push(const Vec3& o, const Vec3& d, Real distance) {
    ox.push_back(o.x), oy.push_back(o.y), oz.push_back(o.z);
    dx.push_back(d.x), dy.push_back(d.y), dz.push_back(d.z);
    reach.push_back(distance);
  }
  [[nodiscard]] std::uint64_t leaked(const tracer::Accelerator& accelerator) const {
    const std::size_t count = reach.size();
    std::vector<tracer::PrimitiveRef> primitive(count);
    std::vector<double> t(count), u(count), v(count);
    accelerator.intersect({ox.data(), oy.data(), oz.data(), dx.data(), dy.data(), dz.data(), nullptr, nullptr, count},
                          {primitive.data(), t.data(), u.data(), v.data()}, tracer::Coherence::incoherent);
    std::uint64_t through = 0;
    // A hit more than a thousandth of the box behind the target belongs to another triangle.
    for (std::size_t i = 0; i < count; ++i) through += primitive[i].hit() && t[i] <= reach[i] + 1e-3L ? 0 : 1;
    return through;
  }
};

void push_random(const TriangleGeometry& mesh, const Around& around, CameraRay generate_ray, Random& random,
                 Batch& batch) {
  for (;;) {
    const Target target = random_target(mesh, around, generate_ray, random);
    const Real distance = random.chance(0.1) ? random.spread(1, 1e6) : random.spread(1e-2, 2);
    const Vec3 origin = rounded(target.point + distance * random.direction());
    const Vec direction = unit(target.point - Vec(origin));
    if (!closed_to(mesh, target, direction)) continue;
    batch.push(origin, rounded(direction), length(target.point - Vec(origin)));
    return;
  }
}

}  // namespace

Count count(const TriangleGeometry& mesh, CameraRay generate_ray, std::uint64_t rays, std::uint64_t seed) {
  tracer::GeometrySet set;
  set.triangles.push_back(mesh);
  tracer::RenderControl control;
  const auto accelerator = tracer::Accelerator::build(set, control);
  if (!accelerator) throw std::runtime_error("no accelerator: " + accelerator.error().detail);
  const Around around = triangles_around(mesh);
  Random random(seed);
  Count total;
  while (total.rays < rays) {
    Batch batch;
    for (int i = 0; i < 4096; ++i) push_random(mesh, around, generate_ray, random, batch);
    total += {batch.reach.size(), batch.leaked(**accelerator)};
  }
  return total;
}

tracer::Mesh lathe(std::uint32_t around, std::uint32_t rings) {
  tracer::Mesh mesh;
  for (std::uint32_t ring = 0; ring < rings; ++ring) {
    const double z = rings > 1 ? 0.8 * ring / (rings - 1) - 0.4 : 0;
    const double radius = 0.3 + 0.1 * std::cos(9 * z);
    for (std::uint32_t step = 0; step < around; ++step) {
      const double turn = 2 * std::numbers::pi * step / around;
      mesh.positions.push_back({radius * std::cos(turn), radius * std::sin(turn), z});
    }
  }
  const auto bottom = static_cast<std::uint32_t>(mesh.positions.size()), top = bottom + 1;
  mesh.positions.push_back({0, 0, -0.5});
  mesh.positions.push_back({0, 0, 0.5});
  for (std::uint32_t step = 0; step < around; ++step) {
    const std::uint32_t next = (step + 1) % around;
    mesh.triangles.push_back({bottom, next, step});
    for (std::uint32_t ring = 0; ring + 1 < rings; ++ring) {
      const std::uint32_t low = ring * around, high = low + around;
      mesh.triangles.push_back({low + step, low + next, high + next});
      mesh.triangles.push_back({low + step, high + next, high + step});
    }
    const std::uint32_t last = (rings - 1) * around;
    mesh.triangles.push_back({top, last + step, last + next});
  }
  return mesh;
}

tracer::Mesh box() {
  tracer::Mesh mesh;
  for (std::uint32_t corner = 0; corner < 8; ++corner)
    mesh.positions.push_back(
        {(corner & 1) != 0 ? 0.5 : -0.5, (corner & 2) != 0 ? 0.35 : -0.35, (corner & 4) != 0 ? 0.2 : -0.2});
  mesh.triangles = {{0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}, {0, 1, 5}, {0, 5, 4},
                    {2, 6, 7}, {2, 7, 3}, {0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}};
  return mesh;
}

}  // namespace leaks
