// Rays against discs, cylinders, cones, boxes and ellipsoids, plain and under affine maps, as the accelerator answers,
// beside every root of every part in long double.
#include <algorithm>
#include <optional>

#include "tests/support/effort.h"
#include "tests/support/random.h"
#include "tests/unit/accel/ray_batch.h"

namespace tracer {
namespace {

using oracle::Random;
using oracle::Real;
using oracle::Vec;

constexpr Real infinity = std::numeric_limits<Real>::infinity();

/// The map in long double, and its inverse by Gauss-Jordan elimination with pivots.
struct Map {
  std::array<std::array<Real, 3>, 3> forward{}, back{};
  Vec offset;

  explicit Map(const Affine& a) : offset(a.offset) {
    const std::array<Vec, 3> columns{Vec(a.linear.x), Vec(a.linear.y), Vec(a.linear.z)};
    for (std::size_t j = 0; j < 3; ++j) {
      forward[0][j] = columns[j].x;
      forward[1][j] = columns[j].y;
      forward[2][j] = columns[j].z;
      back[j][j] = 1;
    }
    auto m = forward;
    for (std::size_t c = 0; c < 3; ++c) {
      std::size_t pivot = c;
      for (std::size_t r = c + 1; r < 3; ++r)
        if (std::fabs(m[r][c]) > std::fabs(m[pivot][c])) pivot = r;
      std::swap(m[c], m[pivot]);
      std::swap(back[c], back[pivot]);
      const Real scale = 1 / m[c][c];
      for (std::size_t k = 0; k < 3; ++k) m[c][k] *= scale, back[c][k] *= scale;
      for (std::size_t r = 0; r < 3; ++r) {
        if (r == c) continue;
        const Real factor = m[r][c];
        for (std::size_t k = 0; k < 3; ++k) m[r][k] -= factor * m[c][k], back[r][k] -= factor * back[c][k];
      }
    }
  }

  static Vec times(const std::array<std::array<Real, 3>, 3>& m, const Vec& v) {
    return {m[0][0] * v.x + m[0][1] * v.y + m[0][2] * v.z, m[1][0] * v.x + m[1][1] * v.y + m[1][2] * v.z,
            m[2][0] * v.x + m[2][1] * v.y + m[2][2] * v.z};
  }
  [[nodiscard]] Vec point(const Vec& p) const { return offset + times(forward, p); }
  [[nodiscard]] Vec shape_point(const Vec& p) const { return times(back, p - offset); }
  [[nodiscard]] Vec shape_direction(const Vec& d) const { return times(back, d); }
  /// How much longer a shape's vector may be than its image, at most.
  [[nodiscard]] Real growth() const {
    Real sum = 0;
    for (const auto& row : back)
      for (const Real entry : row) sum += entry * entry;
    return std::sqrt(sum);
  }
};

/// Where the line meets the shape's surface: every crossing, with how far it is from being one more or one fewer, in
/// the shape's units, and the sine of its angle to the surface, on which t's error depends.
struct Crossing {
  Real t = 0, margin = 0, steepness = 1;
  QuadricPart part{};
};

struct Line {
  Vec o, d;  // shape's space
  [[nodiscard]] Vec at(Real t) const { return o + t * d; }
};

struct Crossings {
  std::vector<Crossing> all;
  Real margin = infinity;  ///< of the nearest miss

  void offer(Real t, Real inside, Real steepness, QuadricPart part) {
    if (!std::isfinite(t) || std::isnan(inside)) return;
    if (inside >= 0) {
      all.push_back({t, inside, steepness, part});
    } else {
      margin = std::fmin(margin, -inside);
    }
  }
};

void disc_crossings(const Line& line, Real z, Real inner, Real outer, QuadricPart part, Crossings& found) {
  if (line.d.z == 0) return;
  const Real t = (z - line.o.z) / line.d.z;
  const Vec p = line.at(t);
  const Real r = std::hypot(p.x, p.y);
  // The angle to the plane makes the margin: a grazing ray's place in it is known less well.
  const Real inside = std::fmin(outer - r, inner > 0 ? r - inner : infinity);
  const Real steepness = std::fabs(line.d.z) / length(line.d);
  found.offer(t, inside * steepness, steepness, part);
}

/// A quadratic with the given coefficients; nothing where the discriminant is negative.
std::vector<Real> roots(Real a, Real b, Real c) {  // a t^2 - 2 b t + c
  const Real discriminant = b * b - a * c;
  if (a == 0) return b != 0 ? std::vector<Real>{c / (2 * b)} : std::vector<Real>{};
  if (discriminant < 0) return {};
  const Real root = std::sqrt(discriminant);
  const Real q = b >= 0 ? b + root : b - root;
  if (q == 0) return {0};
  return {q / a, c / q};
}

Crossings crossings_of(const Quadric& q, const Line& line) {
  Crossings found;
  const Vec &o = line.o, &d = line.d;
  const Real speed = length(d);
  // From the point nearest to the shape's middle, so that distance costs no digits here either.
  const Vec middle = q.kind == QuadricKind::ellipsoid ? Vec{} : Vec(0, 0, 0.5L);
  const Real shift = -dot(o - middle, d) / dot(d, d);
  const Vec n = o + shift * d;
  switch (q.kind) {
    case QuadricKind::ellipsoid: {
      const Real miss = length(n);
      if (miss > 1) {
        found.margin = miss - 1;
        break;
      }
      const Real half = std::sqrt((1 - miss) * (1 + miss)) / speed;
      for (const Real t : {shift - half, shift + half})
        found.all.push_back({t, 1 - miss, half * speed, QuadricPart::side});
      break;
    }
    case QuadricKind::disc:
      disc_crossings(line, 0, q.radius_0, 1, QuadricPart::cap_1, found);
      break;
    case QuadricKind::frustum: {
      const Real slope = Real(q.radius_1) - q.radius_0, w = q.radius_0 + slope * n.z, dw = slope * d.z;
      const Real a = d.x * d.x + d.y * d.y - dw * dw, b = -(n.x * d.x + n.y * d.y - w * dw);
      const Real c = n.x * n.x + n.y * n.y - w * w;
      // How far the line is from being tangent.
      const Real turn = n.x * d.y - n.y * d.x, ox = n.x * dw - w * d.x, oy = n.y * dw - w * d.y;
      const Real tangency = std::fabs(ox * ox + oy * oy - turn * turn) / dot(d, d);
      found.margin = std::fmin(found.margin, tangency);
      for (const Real t : roots(a, b, c)) {
        const Real z = n.z + t * d.z;
        // Steep against the side, an error along the normal moves z far.
        const Vec p = n + t * d;
        const Real r = std::hypot(p.x, p.y);
        const Vec normal = r > 0 ? unit(Vec(p.x / r, p.y / r, -slope)) : Vec{};
        const Real steepness = std::fabs(dot(normal, d)) / speed;
        // Towards the apex the equation flattens as r does, and its roots are known the less well.
        found.offer(t + shift, std::fmin(z, 1 - z) * steepness, steepness * std::fmin(r, 1.0L), QuadricPart::side);
      }
      if (q.caps && q.radius_0 > 0) disc_crossings({n, d}, 0, 0, q.radius_0, QuadricPart::cap_0, found);
      if (q.caps && q.radius_1 > 0) disc_crossings({n, d}, 1, 0, q.radius_1, QuadricPart::cap_1, found);
      for (Crossing& crossing : found.all)
        if (crossing.part != QuadricPart::side) crossing.t += shift;
      break;
    }
    case QuadricKind::box: {
      const std::array<Real, 3> on{n.x, n.y, n.z}, dd{d.x, d.y, d.z};
      for (std::size_t axis = 0; axis < 3; ++axis)
        for (const int side : {0, 1}) {
          if (dd[axis] == 0) continue;
          const Real t = (side - on[axis]) / dd[axis];
          Real inside = infinity;
          for (std::size_t other = 0; other < 3; ++other) {
            const Real p = on[other] + t * dd[other];
            if (other != axis) inside = std::fmin(inside, std::fmin(p, 1 - p));
          }
          const Real steepness = std::fabs(dd[axis]) / speed;
          found.offer(t + shift, inside * steepness, steepness,
                      static_cast<QuadricPart>(static_cast<int>(QuadricPart::x_0) + 2 * static_cast<int>(axis) + side));
        }
      break;
    }
  }
  return found;
}

// ---- cases ---------------------------------------------------------------------------------------------------------

Quadric random_quadric(Random& random, QuadricKind kind, bool mapped) {
  const double size = random.spread(1e-6, 0.3);
  Affine map{{{size, 0, 0}, {0, size, 0}, {0, 0, size}}, random.vector(0.2)};
  if (mapped) {
    // Turned, stretched, sheared; half of them mirrored.
    do {
      const auto column = [&] {
        return rounded(static_cast<Real>(size * random.spread(0.05, 1)) * random.direction());
      };
      map.linear = {column(), column(), column()};
    } while (std::abs(determinant({normalize(map.linear.x), normalize(map.linear.y), normalize(map.linear.z)})) < 0.02);
  }
  Quadric q = quadric(kind, map);
  if (kind == QuadricKind::disc) q.radius_0 = random.chance(0.5) ? 0 : random.in(0.05, 0.95);
  if (kind == QuadricKind::frustum) {
    q.caps = random.chance(0.7);
    if (random.chance(0.7))
      (random.chance(0.5) ? q.radius_0 : q.radius_1) = random.chance(0.5) ? 0 : random.in(0.01, 1);
  }
  return q;
}

Vec around(Random& random) { return random.direction(); }

/// A point of interest on the shape, in its own space: anywhere on it, a rim, an edge, a corner, the apex, the axis.
Vec target_of(Random& random, const Quadric& q) {
  const Real turn = 6.2831853071795864769L * random.in(0, 1), x = std::cos(turn), y = std::sin(turn);
  switch (q.kind) {
    case QuadricKind::ellipsoid:
      return random.chance(0.5) ? around(random) : random.in(0, 1.2) * around(random);
    case QuadricKind::disc: {
      const Real r = random.chance(0.3) ? 1 : random.chance(0.3) ? q.radius_0 : random.in(0, 1.2);
      return {r * x, r * y, 0};
    }
    case QuadricKind::frustum: {
      const Real z = random.chance(0.3) ? random.below(2) : random.in(-0.2, 1.2);
      const Real rim = q.radius_0 + (q.radius_1 - q.radius_0) * z;
      const Real r = random.chance(0.6) ? rim : random.chance(0.2) ? 0 : random.in(0, 1) * rim;
      return {r * x, r * y, z};
    }
    case QuadricKind::box: {
      const auto coordinate = [&]() -> Real { return random.chance(0.35) ? random.below(2) : random.in(-0.1, 1.1); };
      return {coordinate(), coordinate(), coordinate()};
    }
  }
  return {};
}

/// In the shape's space: from inside, near, or far away; the direction past a point of interest, along an axis, within
/// a face, along the side.
Line random_line(Random& random, const Quadric& q) {
  Line line;
  const Vec target = target_of(random, q);
  line.d = around(random);
  switch (random.below(6)) {
    case 0:
      line.d = {0, 0, 0};
      (random.below(3) == 0 ? line.d.x : random.below(2) == 0 ? line.d.y : line.d.z) = random.sign();
      break;
    case 1: {  // along the side, or nearly
      const Real r = std::hypot(target.x, target.y);
      if (r > 0 && q.kind == QuadricKind::frustum) {
        const Real slope = Real(q.radius_1) - q.radius_0;
        line.d = Vec(target.x / r * slope, target.y / r * slope, 1) +
                 static_cast<Real>(random.chance(0.5) ? 0 : random.spread(1e-15, 1e-3)) * around(random);
        line.d = static_cast<Real>(random.sign()) * unit(line.d);
      }
      break;
    }
    case 2: {  // nearly within a face or cap
      line.d.z *= random.spread(1e-15, 1e-2);
      line.d = unit(line.d);
      break;
    }
    default:
      break;
  }
  const Real back = random.chance(0.15) ? random.spread(1e-9, 1e-3) : random.chance(0.15) ? 1e6 : random.in(0, 4);
  line.o = target - back * line.d;
  return line;
}

struct Counts {
  std::uint64_t tried = 0, certain = 0, hits = 0;
};

void compare(const Quadric& q, const std::vector<TestRay>& rays, Counts& counts) {
  GeometrySet set;
  set.quadrics.emplace_back();
  set.quadrics[0].quadrics.push_back(q);
  set.quadrics[0].object.push_back(0);
  const auto accelerator = built(set);
  const RayBatch batch(rays);
  const Map map({q.trace_from_shape, q.origin});
  for (const Coherence coherence : {Coherence::coherent, Coherence::incoherent}) {
    const auto found = batch.closest(*accelerator, coherence);
    const auto blocked = batch.occluded(*accelerator, coherence);
    for (std::size_t i = 0; i < rays.size(); ++i) {
      const Line line{map.shape_point(rays[i].origin), map.shape_direction(rays[i].direction)};
      const Crossings crossings = crossings_of(q, line);
      // What the shape's space cannot tell apart in double: its coordinates there, and what the map loses.
      const Real reach = length(Vec(rays[i].origin) - Vec(q.origin));
      const Real doubt = 64 * 0x1p-53L * (1 + length(line.o) + map.growth() * reach);
      Real nearest = infinity, second = infinity, margin = crossings.margin, steepness = 1;
      QuadricPart part{};
      bool starts_on_it = false;
      for (const Crossing& crossing : crossings.all) {
        margin = std::fmin(margin, crossing.margin);
        starts_on_it |= std::fabs(crossing.t) * length(line.d) * crossing.steepness < 4 * doubt;
        if (crossing.t <= 0) continue;
        if (crossing.t < nearest) {
          second = nearest;
          nearest = crossing.t;
          part = crossing.part;
          steepness = crossing.steepness;
        } else {
          second = std::fmin(second, crossing.t);
        }
      }
      ++counts.tried;
      const bool expected = nearest < rays[i].t_max;
      const Real slack = 2 * doubt / (steepness * length(line.d));
      const bool at_its_end = std::fabs(nearest - rays[i].t_max) < slack;
      // Whether a nearest crossing is one must be certain; those behind it do not matter, so this asks too much.
      if (margin < 4 * doubt || starts_on_it || at_its_end) continue;
      ++counts.certain;
      counts.hits += expected ? 1 : 0;
      ASSERT_EQ(found[i].primitive.hit(), expected)
          << "kind " << static_cast<int>(q.kind) << " radii " << q.radius_0 << " " << q.radius_1 << " t "
          << static_cast<double>(nearest) << " margin " << static_cast<double>(margin / doubt) << " from ("
          << static_cast<double>(line.o.x) << " " << static_cast<double>(line.o.y) << " "
          << static_cast<double>(line.o.z) << ") along (" << static_cast<double>(line.d.x) << " "
          << static_cast<double>(line.d.y) << " " << static_cast<double>(line.d.z) << ")";
      ASSERT_EQ(blocked[i], expected) << "kind " << static_cast<int>(q.kind);
      if (!expected) continue;
      ASSERT_LE(std::fabs(found[i].t - nearest), slack)
          << "kind " << static_cast<int>(q.kind) << " t " << found[i].t << " expected " << static_cast<double>(nearest);
      if (second - nearest > 2 * slack) {
        ASSERT_EQ(static_cast<int>(found[i].u), static_cast<int>(part)) << "kind " << static_cast<int>(q.kind);
      }
    }
  }
}

void try_kind(QuadricKind kind, bool mapped, std::uint64_t seed) {
  Random random(seed);
  Counts counts;
  const std::uint64_t shapes = effort::cases(1400);
  for (std::uint64_t shape = 0; shape < shapes; ++shape) {
    const Quadric q = random_quadric(random, kind, mapped);
    const Map map({q.trace_from_shape, q.origin});
    std::vector<TestRay> rays;
    while (rays.size() < 365) {  // not a multiple of sixteen
      const Line line = random_line(random, q);
      TestRay ray;
      ray.origin = rounded(map.point(line.o));
      ray.direction = rounded(unit(map.point(line.d) - map.offset));
      if (random.chance(0.15))
        ray.t_max = static_cast<double>(length(Vec(ray.origin) - map.offset)) * random.in(0.3, 1.7);
      rays.push_back(ray);
    }
    compare(q, rays, counts);
    if (testing::Test::HasFatalFailure()) return;
  }
  testing::Test::RecordProperty("certain", static_cast<int>(counts.certain));
  EXPECT_GT(counts.certain, counts.tried * 3 / 10) << "the oracle must not shirk";
  EXPECT_GT(counts.hits, counts.certain / 8);
  EXPECT_LT(counts.hits, counts.certain);
}

TEST(EllipsoidHits, AreTheOraclesForRaysFromAnywhere) { try_kind(QuadricKind::ellipsoid, false, 1); }
TEST(EllipsoidHits, AreTheOraclesUnderAnyNonSingularMap) { try_kind(QuadricKind::ellipsoid, true, 2); }
TEST(DiscHits, AreTheOraclesForRaysFromAnywhere) { try_kind(QuadricKind::disc, false, 3); }
TEST(DiscHits, AreTheOraclesUnderAnyNonSingularMap) { try_kind(QuadricKind::disc, true, 4); }
TEST(CylinderAndConeHits, AreTheOraclesForRaysFromAnywhere) { try_kind(QuadricKind::frustum, false, 5); }
TEST(CylinderAndConeHits, AreTheOraclesUnderAnyNonSingularMap) { try_kind(QuadricKind::frustum, true, 6); }
TEST(BoxHits, AreTheOraclesForRaysFromAnywhere) { try_kind(QuadricKind::box, false, 7); }
TEST(BoxHits, AreTheOraclesUnderAnyNonSingularMap) { try_kind(QuadricKind::box, true, 8); }

// ---- what an oracle's margins leave out ----------------------------------------------------------------------------

TestHit single(const Quadric& q, const Vec3& origin, const Vec3& direction) {
  GeometrySet set;
  set.quadrics.emplace_back();
  set.quadrics[0].quadrics.push_back(q);
  set.quadrics[0].object.push_back(0);
  const auto hits = RayBatch({{origin, direction}}).closest(*built(set), Coherence::incoherent);
  return hits[0];
}

Quadric standard(QuadricKind kind) { return quadric(kind, {}); }

TEST(BoxHits, OfRaysAlongTheAxesWhateverTheSignOfTheirZeros) {
  const Quadric box = standard(QuadricKind::box);
  for (const double zero : {0.0, -0.0})
    for (const double other : {0.0, -0.0})
      for (const double y : {0.0, 0.25, 1.0}) {
        EXPECT_EQ(single(box, {-1, y, 0.5}, {1, zero, other}).t, 1) << y;
        EXPECT_EQ(single(box, {2, y, 1}, {-1, zero, other}).t, 1) << y;
        EXPECT_EQ(single(box, {0.25, y, 0.5}, {-1, zero, other}).t, 0.25) << "from inside";
        EXPECT_FALSE(single(box, {-1, 1.5, 0.5}, {1, zero, other}).primitive.hit());
        EXPECT_FALSE(single(box, {-1, -0.5, 0.5}, {1, zero, other}).primitive.hit());
      }
}

TEST(CylinderAndConeHits, OfRaysAlongTheAxisAreTheCaps) {
  Quadric cone = standard(QuadricKind::frustum);
  EXPECT_EQ(single(cone, {0, 0, -2}, {0, 0, 1}).t, 2);
  EXPECT_EQ(single(cone, {1, 0, -2}, {0, 0, 1}).t, 2) << "the rim is closed";
  EXPECT_EQ(single(cone, {0.5, 0, 0.5}, {0, 0, 1}).t, 0.5) << "from inside";
  cone.radius_1 = 0;
  EXPECT_EQ(single(cone, {0, 0, 3}, {0, 0, -1}).t, 2) << "the apex";
  EXPECT_EQ(single(cone, {0, 0, -3}, {0, 0, 1}).t, 3) << "the base";
  EXPECT_EQ(single(cone, {0.5, 0, 3}, {0, 0, -1}).t, 2.5) << "the mirror nappe is not there";
  EXPECT_FALSE(single(cone, {0, -3, 1.5}, {0, 1, 0}).primitive.hit()) << "nor across it";
  cone.caps = false;
  EXPECT_FALSE(single(cone, {1.5, 0, -1}, {0, 0, 1}).primitive.hit());
}

TEST(DiscHits, LeaveTheHoleAndKeepBothRims) {
  Quadric disc = standard(QuadricKind::disc);
  disc.radius_0 = 0.5;
  EXPECT_FALSE(single(disc, {0.25, 0, 1}, {0, 0, -1}).primitive.hit());
  EXPECT_TRUE(single(disc, {0.5, 0, 1}, {0, 0, -1}).primitive.hit());
  EXPECT_TRUE(single(disc, {0, 1, -1}, {0, 0, 1}).primitive.hit());
  EXPECT_FALSE(single(disc, {0, std::nextafter(1.0, 2), -1}, {0, 0, 1}).primitive.hit());
  EXPECT_FALSE(single(disc, {-3, 0, 0}, {1, 0, 0}).primitive.hit()) << "within its plane";
}

}  // namespace
}  // namespace tracer
