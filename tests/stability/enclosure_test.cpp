// A closed box: form factors between its faces, and energy conservation between mirrors. These are identities of
// radiosity, checked with the tracer's rays.
#include <gtest/gtest.h>

#include <numbers>

#include "tests/stability/table.h"
#include "tests/support/effort.h"
#include "tests/support/random.h"
#include "tests/unit/shapes/look.h"

namespace {

using oracle::Random;
using oracle::Real;
using oracle::Vec;
using namespace tracer;
using stability::Oracle;
using stability::Row;

/// Form factor between parallel rectangles a x b at distance c, and between a x b and a x c that share the edge a:
/// Howell, "A Catalog of Radiation Heat Transfer Configuration Factors", C-11 and C-14.
Real parallel(Real a, Real b, Real c) {
  const Real x = a / c, y = b / c, p = std::sqrt(1 + x * x), q = std::sqrt(1 + y * y);
  return 2 / (std::numbers::pi_v<Real> * x * y) *
         (std::log(p * q / std::sqrt(1 + x * x + y * y)) + x * q * std::atan(x / q) + y * p * std::atan(y / p) -
          x * std::atan(x) - y * std::atan(y));
}

Real perpendicular(Real a, Real b, Real c) {
  const Real w = b / a, h = c / a, w2 = w * w, h2 = h * h, s = w2 + h2, r = std::sqrt(s);
  const Real product = (1 + w2) * (1 + h2) / (1 + s) * std::pow(w2 * (1 + s) / ((1 + w2) * s), w2) *
                       std::pow(h2 * (1 + s) / ((1 + h2) * s), h2);
  return (w * std::atan(1 / w) + h * std::atan(1 / h) - r * std::atan(1 / r) + std::log(product) / 4) /
         (std::numbers::pi_v<Real> * w);
}

constexpr std::array<double, 3> sides{1.0, 0.75, 1.5};

/// Face 2 k lies at 0 on axis k, face 2 k + 1 opposite.
Real area(std::size_t face) { return Real(sides[(face / 2 + 1) % 3]) * sides[(face / 2 + 2) % 3]; }

Real form_factor(std::size_t from, std::size_t to) {
  const std::size_t k = from / 2, l = to / 2;
  if (from == to) return 0;
  if (k == l) return parallel(sides[(k + 1) % 3], sides[(k + 2) % 3], sides[k]);
  const std::size_t shared = 3 - k - l;
  return perpendicular(sides[shared], sides[l], sides[k]);  // `from` is as wide as l's axis is long
}

TEST(FormFactors, OfAClosedBoxSumToOne) {
  Row rows(25, "radiosity: a row of form factors sums to 1, no ray is lost", Oracle::conservation, "rays");
  Row factors(25, "radiosity: F beside the catalogue's, to 5 sigma", Oracle::closed_form, "factors");
  Row reciprocal(25, "radiosity: A_i F_ij = A_j F_ji, to 5 sigma", Oracle::conservation, "pairs");
  Random random(1);
  Scene scene = scenes::empty(1);
  const auto at = [&](std::size_t axis, double along, double u, double v) {
    std::array<double, 3> p{};
    p[axis] = along;
    p[(axis + 1) % 3] = u;
    p[(axis + 2) % 3] = v;
    return Vec3{p[0], p[1], p[2]};
  };
  for (std::size_t face = 0; face < 6; ++face) {  // an object each, facing inwards or outwards as it comes
    const std::size_t k = face / 2;
    const double along = face % 2 == 0 ? 0 : sides[k], u = sides[(k + 1) % 3], v = sides[(k + 2) % 3];
    const Mesh mesh{{at(k, along, 0, 0), at(k, along, u, 0), at(k, along, u, v), at(k, along, 0, v)},
                    {{0, 1, 2}, {0, 2, 3}},
                    {},
                    {},
                    false};
    scenes::add(scene, mesh, scenes::matte({1, 1, 1}));
  }
  const auto made = compiled(scene);
  const std::uint64_t rays = effort::cases(60'000);
  std::array<std::array<Real, 6>, 6> counted{};
  for (std::size_t from = 0; from < 6; ++from) {
    const std::size_t k = from / 2;
    for (std::uint64_t i = 0; i < rays; ++i) {
      // Uniform over the face, cosine-weighted directions (Malley's method).
      const double r = std::sqrt(random.in(0, 1)), turn = 2 * std::numbers::pi * random.in(0, 1);
      const double up = std::sqrt(std::max(0.0, 1 - r * r)) * (from % 2 == 0 ? 1 : -1);
      const Vec3 o = at(k, from % 2 == 0 ? 0 : sides[k], sides[(k + 1) % 3] * random.in(0, 1),
                        sides[(k + 2) % 3] * random.in(0, 1));
      const Vec3 d = rounded(unit(Vec(at(k, up, r * std::cos(turn), r * std::sin(turn)))));
      // A step inwards, because the ray has no record of the triangle that it starts on.
      const Vec3 start = made->frame.render_from_world(o) + d * 0x1p-40;
      const Look hit = look(*made, start, d);
      rows.expect(hit.found && hit.surface.object != from);
      if (hit.found) counted[from][hit.surface.object] += 1 / static_cast<Real>(rays);
    }
  }
  for (std::size_t i = 0; i < 6; ++i)
    for (std::size_t j = 0; j < 6; ++j) {
      const auto variance = [&](std::size_t a, std::size_t b) {
        return form_factor(a, b) * (1 - form_factor(a, b)) / static_cast<Real>(rays);
      };
      factors.expect(std::fabs(counted[i][j] - form_factor(i, j)) <= 5 * std::sqrt(variance(i, j)) + 1e-15L,
                     std::to_string(i) + std::to_string(j) + ": " + std::to_string(counted[i][j]) + ", not " +
                         std::to_string(form_factor(i, j)));
      if (i >= j) continue;
      const Real sigma = std::sqrt(area(i) * area(i) * variance(i, j) + area(j) * area(j) * variance(j, i));
      reciprocal.expect(std::fabs(area(i) * counted[i][j] - area(j) * counted[j][i]) <= 5 * sigma);
    }
}

TEST(ClosedBoxOfEmissiveMirrors, HoldsEOverOneMinusRhoEverywhere) {
  Row row(25, "closed box of glowing mirrors: B = E / (1 - rho)", Oracle::closed_form, "pixels");
  for (const double rho : {0.0, 0.3, 0.9, 0.99}) {
    Scene scene = scenes::empty(32);
    scene.camera = {{0.3, 0.4, 0.9}, {1, 0.1, 0.2}, {0, 1, 0}, 120};
    Material wall = scenes::mirror(rho);
    wall.emission = Color{1, 0.5, 0.25};
    scenes::add(scene, Box{{0, 0, 0}, {sides[0], sides[1], sides[2]}}, wall);
    scenes::add(scene, Sphere{{0.7, 0.3, 0.4}, 0.2}, wall);
    scene.accuracy.max_depth = 5000;
    const Image image = stability::render(scene).image;
    const Real expected = 1 / (1 - Real(rho));
    for (std::size_t i = 0; i < image.rgb.size(); i += 3)
      row.expect(std::fabs(image.rgb[i] - expected) <= 1e-6L * expected &&
                 std::fabs(image.rgb[i + 2] - expected / 4) <= 1e-6L * expected);
  }
}

}  // namespace
