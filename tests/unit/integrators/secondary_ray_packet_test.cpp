// Secondary rays of packets of hits, against the laws of reflection, Snell and Fresnel in long double; parts of a queue
// of rays, between which a render can be cancelled.
#include <gtest/gtest.h>

#include <limits>

#include "tests/support/chi_square.h"
#include "tests/support/effort.h"
#include "tests/support/random.h"
#include "tests/support/reference_optics.h"
#include "tracer/src/integrators/whitted/secondary_rays.h"
#include "tracer/src/integrators/whitted/wavefront_state.h"

namespace tracer {
namespace {

using oracle::Random;
using oracle::Real;
using oracle::Vec;

/// Mirrors, glass and panes, with and without Fresnel, and a material without secondary rays.
std::vector<Material> materials() {
  std::vector<Material> all(7);
  for (Material& material : all) material.reflection_color = Color{1, 0.5, 0.25};
  for (Material& material : all) material.transmission_color = Color{0.5, 1, 0.75};
  for (const std::size_t i : {1u, 2u, 4u, 6u}) all[i].reflection = 0.3;
  for (const std::size_t i : {2u, 3u, 4u, 5u}) all[i].transmission = 0.6;
  for (const std::size_t i : {4u, 5u, 6u}) all[i].fresnel = true;
  all[5].transparency = Material::Transparency::filtered;
  return all;
}

struct Packets {
  HitPacket hits;
  ShadingPointPacket shading_points;
  InterfacePacket interfaces;
  SecondaryRayPacket reflection, transmission;
};

Vec3 outward_of(const HitPacket& hits, int i) {
  return hits.back_face[i] > 0 ? -hits.points.face[i] : hits.points.face[i];
}
/// The shading normal, or that of the face if the shading normal points away from the ray.
Vec3 normal_of(const Packets& p, int i) {
  const Vec3 normal = p.shading_points.normal[i];
  return dot(p.hits.direction[i], normal) < 0 ? normal : outward_of(p.hits, i);
}

void fill(Random& random, const std::vector<CompiledMaterial>& terms, Packets& p) {
  p.hits.count = p.shading_points.count = lanes - 2;
  for (int i = 0; i < lanes; ++i) {
    const Vec face = random.direction();
    const double back_face = random.chance(0.4) ? 1 : 0;
    const Vec outward = back_face > 0 ? -face : face;
    const Real c = random.chance(0.2) ? random.spread(1e-4, 1) : random.in(0.01, 1);
    const Vec d = std::sqrt((1 - c) * (1 + c)) * random.across(outward) - c * outward;
    p.hits.direction.set(i, rounded(unit(d)));
    p.hits.points.face.set(i, rounded(face));
    const Vec normal = random.chance(0.5) ? outward : unit(outward + 0.4L * random.direction());
    p.shading_points.normal.set(i, rounded(normal));
    p.hits.points.position.set(i, random.vector(1));
    p.shading_points.clearance[i] = random.spread(1e-17, 1e-12);
    p.hits.back_face[i] = back_face;
    p.hits.throughput.r[i] = random.in(0.1, 1);
    p.hits.throughput.g[i] = random.in(0.1, 1);
    p.hits.throughput.b[i] = 0;
    p.hits.path[i] = random.below(1000);
    p.hits.material[i] = random.below(static_cast<std::uint32_t>(terms.size()));
    p.interfaces.n_from[i] = random.chance(0.5) ? 1 : random.in(1, 3);
    p.interfaces.n_to[i] = random.in(0.5, 2.5);
  }
  gather_coefficients(terms, p.hits);
  spawn_dielectric(p.hits, p.shading_points, p.shading_points.normal, p.interfaces, false, p.reflection,
                   p.transmission);
}

void expect_throughput(const SecondaryRayPacket& found, int i, const HitPacket& hits, const Color& by_color,
                       Real share) {
  const bool going = share > 0;
  ASSERT_EQ(found.going >> i & 1, going ? 1u : 0u);
  if (!going) return;
  EXPECT_NEAR(found.throughput.r[i], static_cast<double>(hits.throughput.r[i] * by_color.r * share), 1e-11);
  EXPECT_NEAR(found.throughput.g[i], static_cast<double>(hits.throughput.g[i] * by_color.g * share), 1e-11);
  EXPECT_EQ(found.throughput.b[i], 0);
  EXPECT_EQ(found.largest[i], std::max(found.throughput.r[i], found.throughput.g[i]));
}

void expect_snell(const Packets& p, int i, bool refracts) {
  const Vec d = p.hits.direction[i], n = normal_of(p, i);
  const Vec t = p.transmission.direction[i];
  const Real eta = refracts ? Real(p.interfaces.n_to[i]) / p.interfaces.n_from[i] : 1;
  EXPECT_NEAR(static_cast<double>(length(t)), 1, 1e-14);
  if (!refracts) {
    EXPECT_EQ(length(t - d), 0) << "not refracted";
    return;
  }
  EXPECT_LT(dot(t, n), 0);
  EXPECT_LE(length(cross(d, n) - eta * cross(t, n)), 1e-12) << i;
}

void expect_mirror(const Packets& p, int i) {
  const Vec d = p.hits.direction[i], n = normal_of(p, i), outward = outward_of(p.hits, i);
  Vec expected = unit(d - 2 * dot(d, n) * n);
  if (std::fabs(dot(expected, outward)) < 1e-12L) return;
  if (dot(expected, outward) < 0) expected = unit(expected - 2 * dot(expected, outward) * outward);
  EXPECT_LE(length(Vec(p.reflection.direction[i]) - expected), 1e-14);
}

void expect_lane(const Packets& p, int i, const Material& material) {
  const bool transmits = material.transmission > 0;
  const bool refracts = transmits && material.transparency == Material::Transparency::refract;
  const Real n_from = p.interfaces.n_from[i], n_to = p.interfaces.n_to[i];
  const Real cos_i = std::fmin(1.0L, -dot(Vec(p.hits.direction[i]), Vec(normal_of(p, i))));
  const Real cos2_t = 1 - (n_from / n_to) * (n_from / n_to) * (1 - cos_i) * (1 + cos_i);
  if (std::fabs(cos2_t) < 1e-4L) return;  // rounding decides next to the critical angle
  const bool total = (refracts || material.fresnel) && cos2_t < 0;
  const Real f = total ? 1 : oracle::reflectance(cos_i, std::sqrt(cos2_t), n_from, n_to);
  const Real reflection = material.fresnel ? f : 1, transmittance = total ? 0 : material.fresnel ? 1 - f : 1;
  Color reflected = std::get<Color>(material.reflection_color) * material.reflection;
  const Color transmitted = std::get<Color>(material.transmission_color) * material.transmission;
  if (total && !material.fresnel) reflected += transmitted;
  expect_throughput(p.reflection, i, p.hits, reflected, is_black(reflected) ? 0 : reflection);
  expect_throughput(p.transmission, i, p.hits, transmitted, transmits ? transmittance : 0);
  if ((p.transmission.going >> i & 1) != 0) expect_snell(p, i, refracts);
  if ((p.reflection.going >> i & 1) != 0) expect_mirror(p, i);
}

TEST(SecondaryRayPacket, FollowsSnellAndFresnelInEveryLane) {
  const std::vector<Material> all = materials();
  const std::vector<CompiledMaterial> terms = compiled_materials(all, {});
  Random random(3);
  Packets p;
  std::uint64_t transmission = 0;
  for (std::uint64_t round = 0; round < effort::cases(2'000); ++round) {
    fill(random, terms, p);
    for (int i = 0; i < p.hits.count; ++i) expect_lane(p, i, all[p.hits.material[i]]);
    if (HasFailure()) FAIL() << round;
    transmission += static_cast<std::uint64_t>(std::popcount(p.transmission.going));
    EXPECT_EQ((p.reflection.going | p.transmission.going) >> p.hits.count, 0u) << "unused lanes";
  }
  EXPECT_GT(transmission, effort::cases(2'000));
}

/// Density of the directions `l` to which facets that are visible from `v` reflect or refract, about the z axis (Walter
/// et al. 2007, eq. 14, 17, 33 and 34). `n`: index of refraction on the other side over that on the side of `v`.
double density_of_glass(const Vec3& v, const Vec3& l, bool reflects, double n, double alpha) {
  Vec3 h = normalize(reflects ? v + l : v + l * n);
  if (h.z < 0) h = -h;
  const double to_eye = dot(v, h), to_light = dot(l, h), sum = to_eye + n * to_light;
  if (!(to_eye > 0 && (to_light > 0) == reflects)) return 0;
  const auto squared_tangent = [](double cosine) { return 1 / (cosine * cosine) - 1; };
  const double root = h.z * h.z * (alpha * alpha + squared_tangent(h.z)) / alpha;
  const double masking = 2 / (1 + std::sqrt(1 + alpha * alpha * squared_tangent(v.z)));
  const double jacobian = reflects ? 1 / (4 * to_eye) : n * n * -to_light / (sum * sum);
  return masking * to_eye / v.z / (std::numbers::pi * root * root) * jacobian;
}

TEST(SecondaryRayPacket, OfRoughGlassHasTheDensityOfItsVisibleFacets) {
  std::vector<Material> glass(1);
  glass[0].transmission = glass[0].reflection = 1;
  glass[0].fresnel = true;
  const Vec3 normal{0, 0, 1};
  Packets p{};
  p.hits.count = p.shading_points.count = 1;
  p.hits.points.face.set(0, normal);
  p.hits.throughput.set(0, {1, 1, 1});
  gather_coefficients(compiled_materials(glass, {}), p.hits);
  for (const double n : {1.1, 2.4, 1 / 1.5})
    for (const double alpha : {0.5, 1.0})
      for (const double cosine : {0.9, 0.4}) {
        const Vec3 v{0, std::sqrt(1 - cosine * cosine), cosine};
        const PrincipledPoint point({.alpha = alpha}, normal, v);
        p.hits.direction.set(0, -v);
        p.interfaces.n_to[0] = n;
        for (const bool reflects : {true, false}) {
          SCOPED_TRACE(testing::Message() << n << ' ' << alpha << ' ' << cosine << ' ' << reflects);
          const SecondaryRayPacket& rays = reflects ? p.reflection : p.transmission;
          const auto spawned = [&](const Vec2& xi) {
            VecLanes facets{};
            facets.set(0, point.sample_facet(xi));
            spawn_dielectric(p.hits, p.shading_points, facets, p.interfaces, true, p.reflection, p.transmission);
            return (rays.going & 1) != 0 ? rays.direction[0] : Vec3{};
          };
          const auto density = [&](const Vec3& l) {  // with those that arrive on the wrong side of the face
            return density_of_glass(v, l, reflects, n, alpha) +
                   density_of_glass(v, {l.x, l.y, -l.z}, reflects, n, alpha);
          };
          statistics::expect_distribution(spawned, density, reflects ? normal : -normal, 0);
        }
      }
}

TEST(SecondaryRayPacket, IsBitIdenticalForMirrorsInPacketsWithAndWithoutSplits) {
  const std::vector<CompiledMaterial> terms = compiled_materials(materials(), {});
  Random random(4);
  Packets p;
  SecondaryRayPacket plain;
  for (std::uint64_t round = 0; round < effort::cases(2'000); ++round) {
    fill(random, terms, p);
    spawn_reflection(p.hits, p.shading_points, plain);
    for (int i = 0; i < p.hits.count; ++i) {
      if (p.hits.material[i] != 1) continue;
      ASSERT_EQ(p.reflection.going >> i & 1, plain.going >> i & 1);
      ASSERT_EQ(p.reflection.origin[i], plain.origin[i]);
      ASSERT_EQ(p.reflection.direction[i], plain.direction[i]);
      ASSERT_EQ(p.reflection.throughput[i], plain.throughput[i]);
      ASSERT_EQ(p.reflection.largest[i], plain.largest[i]);
      ASSERT_EQ(p.reflection.path[i], plain.path[i]);
    }
  }
}

TEST(SecondaryRayPacket, OffsetsOriginsToTheSideOfTheDirection) {
  const std::vector<CompiledMaterial> terms = compiled_materials(materials(), {});
  Random random(5);
  Packets p;
  for (std::uint64_t round = 0; round < effort::cases(500); ++round) {
    fill(random, terms, p);
    for (const SecondaryRayPacket* rays : {&p.reflection, &p.transmission})
      for_each_lane(rays->going, [&](int i) {
        const Vec3 face = p.hits.points.face[i];
        const Vec moved = Vec(rays->origin[i]) - Vec(p.hits.points.position[i]);
        const double side = dot(rays->direction[i], face) < 0 ? -1 : 1;
        ASSERT_GE(side * dot(moved, Vec(face)), p.shading_points.clearance[i]);
      });
  }
}

TEST(RaysNotAbove, AThroughputAreFaintOrNotANumber) {
  SecondaryRayPacket rays{};
  rays.going = 0b1011;
  rays.largest[0] = 0.1;
  rays.largest[1] = 0.01;
  rays.largest[2] = 0.01;  // not a lane of `going`
  rays.largest[3] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(not_above(rays, 0.05), 0b1010u);
  EXPECT_EQ(not_above(rays, 0.1), 0b1011u);
}

TEST(PartsOfRays, EndAfterACancellation) {
  RenderControl control;
  const std::vector<double> v(16384);
  const std::vector<PrimitiveRef> from(v.size());
  const double* all = v.data();
  std::size_t traced = 0;
  for_each_part({all, all, all, all, all, all, all, from.data(), v.size()}, control,
                [&](const RaySpan& part, std::size_t) {
                  traced += part.count;
                  if (traced >= 1000) control.cancel();
                });
  EXPECT_LT(traced, 2000u);
}

}  // namespace
}  // namespace tracer
