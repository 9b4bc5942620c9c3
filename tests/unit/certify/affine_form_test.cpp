#include "tracer/src/certify/affine_form.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/random.h"

namespace {

using namespace tracer;

using Real = long double;

/// A random form, and a value of it at a position in long double.
struct Sampled {
  AffineForm form;
  Real value;
};

class AffineFormTest : public testing::Test {
 protected:
  /// A form about `center`, and its value at (s, t) with any error.
  Sampled draw(double center, double radius) {
    const AffineForm form{center, random.in(-radius, radius), random.in(-radius, radius),
                          random.chance(0.5) ? 0 : random.in(0, radius)};
    return {form, form.center + Real{form.x} * s + Real{form.y} * t + Real{form.error} * random.in(-1, 1)};
  }
  void move() {
    s = random.chance(0.2) ? random.sign() : random.in(-1, 1);
    t = random.chance(0.2) ? random.sign() : random.in(-1, 1);
  }
  /// The value at (s, t) lies within the form's error there. `terms`: their size, if they may cancel.
  void expect_contains(const AffineForm& form, Real value, const char* what, double terms = 0) const {
    if (!std::isfinite(form.error)) return;
    const Real middle = form.center + Real{form.x} * s + Real{form.y} * t;
    const Real oracle_rounding = std::max(form.magnitude(), terms) * 0x1p-60L;
    EXPECT_LE(std::abs(middle - value), form.error + oracle_rounding) << what;
    EXPECT_LE(form.range().low - oracle_rounding, value) << what;
    EXPECT_GE(form.range().high + oracle_rounding, value) << what;
  }

  oracle::Random random{1};
  double s = 0, t = 0;
};

TEST_F(AffineFormTest, OperationsContainTheExactResult) {
  for (int i = 0; i < 100'000; ++i) {
    move();
    const double size = random.spread(1e-6, 1e6);
    const auto [a, exact_a] = draw(random.in(-size, size), random.spread(1e-12, 1) * size);
    const auto [b, exact_b] = draw(random.in(-size, size), random.spread(1e-12, 1) * size);
    const double factor = random.in(-3, 3);
    expect_contains(a + b, exact_a + exact_b, "sum", size);
    expect_contains(a - b, exact_a - exact_b, "difference", size);
    expect_contains(a * b, exact_a * exact_b, "product");
    expect_contains(a * factor, exact_a * factor, "multiple");
    expect_contains(a + factor, exact_a + factor, "shifted", size + 3);
    expect_contains(squared(a), exact_a * exact_a, "square");
    if (exact_a != 0) expect_contains(inverse(a), 1 / exact_a, "inverse");
    if (exact_a >= 0) expect_contains(square_root(a), std::sqrt(exact_a), "square root");
  }
}

TEST_F(AffineFormTest, OperationsOnVectorsContainTheExactResult) {
  for (int i = 0; i < 30'000; ++i) {
    move();
    const double size = random.spread(1e-3, 1e3);
    const auto component = [&] { return draw(random.in(-size, size), random.spread(1e-12, 1) * size); };
    const Sampled a[3] = {component(), component(), component()}, b[3] = {component(), component(), component()};
    const AffineVec u{a[0].form, a[1].form, a[2].form}, v{b[0].form, b[1].form, b[2].form};
    const Vec3 w = random.vector(size);
    const auto products = [&](const Sampled* p, Real x, Real y, Real z) {
      return p[0].value * x + p[1].value * y + p[2].value * z;
    };
    const double terms = 12 * size * size;
    expect_contains(dot(u, v), products(a, b[0].value, b[1].value, b[2].value), "dot", terms);
    expect_contains(dot(u, w), products(a, w.x, w.y, w.z), "dot with a vector", terms);
    expect_contains(squared_length(u), products(a, a[0].value, a[1].value, a[2].value), "squared length", terms);
    expect_contains(cross(u, v).x, a[1].value * b[2].value - a[2].value * b[1].value, "cross", terms);
    const Linear map{random.vector(1), random.vector(1), random.vector(1)};
    expect_contains((map * u).y, products(a, map.x.y, map.y.y, map.z.y), "map", terms);
  }
}

TEST_F(AffineFormTest, DependentTermsCancel) {
  const AffineForm a{5, 1, 2, 0}, same = a;
  const Interval difference = (a - same).range();
  EXPECT_LE(difference.high - difference.low, 1e-13);
  const Interval ratio = (a * inverse(a)).range();  // intervals alone would give [2, 8] / [2, 8] = [1/4, 4]
  EXPECT_GT(ratio.low, -0.6);
  EXPECT_LT(ratio.high, 2.6);
}

/// The width of the nonlinear part shrinks with the square of the radius.
TEST_F(AffineFormTest, NonlinearErrorIsQuadratic) {
  const auto error = [](double radius) {
    const AffineForm a{2, radius, 0, 0};
    return (inverse(a) * square_root(a)).error;
  };
  EXPECT_NEAR(error(1e-3) / error(1e-4), 100, 10);
}

TEST_F(AffineFormTest, OutsideOfTheDomainNothingIsKnown) {
  EXPECT_EQ(inverse(AffineForm{0, 1, 0, 0}).range().high, all_numbers.high);
  EXPECT_EQ((inverse(AffineForm{0, 1, 0, 0}) * exactly(0)).range().low, all_numbers.low);
  EXPECT_EQ((exactly(1e308) * exactly(1e308)).range().high, all_numbers.high);
}

}  // namespace
