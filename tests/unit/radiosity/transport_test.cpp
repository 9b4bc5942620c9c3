// The solver of the radiosity system, against closed forms. The form factors of a cube's patches are exact.
#include "tracer/src/radiosity/transport.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace {

using namespace tracer;

constexpr std::uint32_t sweeps_max = 10'000;

/// A rectangle in a face of the unit cube.
struct Rectangle {
  std::size_t axis = 0;                 ///< that the face is across
  double at = 0;                        ///< its coordinate along this axis
  std::array<double, 3> low{}, high{};  ///< coordinates along the other axes
  [[nodiscard]] double area() const {
    double product = 1;
    for (std::size_t i = 0; i < 3; ++i) product *= i == axis ? 1 : high[i] - low[i];
    return product;
  }
  [[nodiscard]] double end(std::size_t i, int which) const { return which == 0 ? low[i] : high[i]; }
};

/// Terms of Ehlert & Smith 1993, "View Factors for Perpendicular and Parallel Rectangular Plates", J. Thermophysics
/// and Heat Transfer 7(1).
double parallel_term(double x, double y, double z) {
  const double a = std::sqrt(x * x + z * z), b = std::sqrt(y * y + z * z);
  return (y * a * std::atan(y / a) + x * b * std::atan(x / b) - z * z / 2 * std::log(x * x + y * y + z * z)) /
         (2 * std::numbers::pi);
}

double perpendicular_term(double x, double xi, double y) {
  const double a = x * x + xi * xi, root = std::sqrt(a);
  const double turn = root > 0 ? y * root * std::atan(y / root) : 0;
  const double squared = a + y * y;
  return (turn - (squared > 0 ? (a - y * y) / 4 * std::log(squared) : 0)) / (2 * std::numbers::pi);
}

/// Share of the light that leaves `from` and arrives at `to`.
double form_factor(const Rectangle& from, const Rectangle& to) {
  if (from.axis == to.axis && from.at == to.at) return 0;
  double sum = 0;
  for (int number = 0; number < 16; ++number) {
    const int i = number & 1, j = number >> 1 & 1, k = number >> 2 & 1, l = number >> 3 & 1;
    double term = 0;
    if (from.axis == to.axis) {
      const std::size_t a = (from.axis + 1) % 3, b = (from.axis + 2) % 3;
      term = parallel_term(from.end(a, i) - to.end(a, l), from.end(b, j) - to.end(b, k), from.at - to.at);
    } else {
      const std::size_t along = 3 - from.axis - to.axis;
      term = perpendicular_term(std::abs(from.end(to.axis, i) - to.at), std::abs(to.end(from.axis, l) - from.at),
                                from.end(along, j) - to.end(along, k));
    }
    sum += ((i + j + k + l) % 2 == 0 ? 1 : -1) * term;
  }
  // The order of the ends along the distance to the common edge depends on the face.
  return std::abs(sum) / from.area();
}

/// The faces of the unit cube in n x n squares each: floor, ceiling, walls.
std::vector<Rectangle> cube(int n) {
  std::vector<Rectangle> squares;
  for (const std::size_t axis : {2u, 0u, 1u})
    for (const double at : {0.0, 1.0})
      for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) {
          Rectangle& square = squares.emplace_back();
          square.axis = axis;
          square.at = at;
          const std::size_t a = (axis + 1) % 3, b = (axis + 2) % 3;
          square.low[a] = static_cast<double>(i) / n;
          square.high[a] = static_cast<double>(i + 1) / n;
          square.low[b] = static_cast<double>(j) / n;
          square.high[b] = static_cast<double>(j + 1) / n;
        }
  return squares;
}

/// Goral's cube: the floor glows with radiosity 1.
Transport goral(int n, double reflectance) {
  Transport transport;
  const std::vector<Rectangle> squares = cube(n);
  for (std::size_t i = 0; i < squares.size(); ++i) {
    std::vector<TransportEntry> entries;
    for (std::uint32_t j = 0; j < squares.size(); ++j)
      entries.push_back({j, Color{1, 1, 1} * (reflectance * form_factor(squares[i], squares[j]))});
    const double glow = squares[i].axis == 2 && squares[i].at == 0 ? 1 : 0;
    transport.add_row({glow, 2 * glow, 0}, entries);
  }
  return transport;
}

TransportSolution solved(const Transport& transport, double tolerance = 1e-14) {
  RenderControl control;
  return solve(transport, tolerance, sweeps_max, control);
}

/// Entries hold shares as floats.
constexpr double float_error = 1e-6;

double mean_red(const TransportSolution& solution, std::size_t first, std::size_t count) {
  double sum = 0;
  for (std::size_t i = first; i < first + count; ++i) sum += solution.values[i].r;
  return sum / static_cast<double>(count);
}

/// Share of the light of each patch that no other receives; red.
std::vector<double> absorptances(const Transport& transport) {
  std::vector<double> shares(transport.size(), 1);
  for (std::size_t i = 0; i < transport.size(); ++i)
    for (const TransportEntry& entry : transport.row(i)) shares[entry.patch] -= entry.r;
  return shares;
}

TEST(FormFactors, OfTheOracleAreThoseOfCatalogues) {
  const std::vector<Rectangle> faces = cube(1);
  EXPECT_NEAR(form_factor(faces[0], faces[1]), 0.199824895698387, 1e-14);  // Howell C-11
  EXPECT_NEAR(form_factor(faces[0], faces[2]), 0.200043776075403, 1e-14);  // C-14
  for (const Rectangle& from : cube(4)) {
    double sum = 0;
    for (const Rectangle& to : cube(4)) {
      sum += form_factor(from, to);
      ASSERT_NEAR(from.area() * form_factor(from, to), to.area() * form_factor(to, from), 1e-15);
    }
    ASSERT_NEAR(sum, 1, 1e-12);
  }
}

TEST(TransportSolution, OfGoralsCubeIsThePublishedOne) {
  struct Expected {
    int n;
    double reflectance, floor, walls, ceiling;
  };
  for (const auto& [n, reflectance, floor, walls, ceiling] :
       {Expected{1, 0.5, 1.090909, 0.181836, 0.181746}, Expected{2, 0.5, 1.099016, 0.181836, 0.173639},
        Expected{4, 0.5, 1.102646, 0.181381, 0.171829}, Expected{8, 0.5, 1.103845, 0.181196, 0.171373},
        Expected{8, 0.8, 1.585939, 0.688120, 0.661580}}) {
    const Transport transport = goral(n, reflectance);
    const TransportSolution solution = solved(transport);
    const auto face = static_cast<std::size_t>(n) * static_cast<std::size_t>(n);
    EXPECT_NEAR(mean_red(solution, 0, face), floor, 6e-7) << n;
    EXPECT_NEAR(mean_red(solution, face, face), ceiling, 6e-7) << n;
    EXPECT_NEAR(mean_red(solution, 2 * face, 4 * face), walls, 6e-7) << n;
    const std::vector<double> absorptance = absorptances(transport);
    double glowing = 0, absorbed = 0;
    for (std::size_t i = 0; i < 6 * face; ++i) {
      glowing += transport.source(i).r;
      absorbed += absorptance[i] * solution.values[i].r;
      ASSERT_NEAR(absorptance[i], 1 - reflectance, float_error) << n;
    }
    EXPECT_NEAR(absorbed, glowing, 1e-12 * glowing) << n;
    for (const Color& value : solution.values) {
      ASSERT_NEAR(value.g, 2 * value.r, 1e-12);
      ASSERT_EQ(value.b, 0);
    }
  }
}

TEST(TransportSolution, SolvesEveryRow) {
  const Transport transport = goral(4, 0.9);
  const TransportSolution solution = solved(transport);
  for (std::size_t i = 0; i < transport.size(); ++i) {
    double row = transport.source(i).r;
    for (const TransportEntry& entry : transport.row(i)) row += entry.r * solution.values[entry.patch].r;
    ASSERT_NEAR(solution.values[i].r, row, 1e-13) << i;
  }
}

TEST(TransportSolution, IsWithinItsBoundAfterEverySweep) {
  const Transport transport = goral(2, 0.9);
  const TransportSolution exact = solved(transport);
  double before = std::numeric_limits<double>::infinity();
  RenderControl control;
  for (std::uint32_t sweeps = 1; sweeps <= 40; ++sweeps) {
    const TransportSolution early = solve(transport, 0, sweeps, control);
    double difference = 0;
    for (std::size_t i = 0; i < exact.values.size(); ++i)
      difference = std::max(difference, std::abs(early.values[i].g - exact.values[i].g));
    ASSERT_LE(difference, early.bound) << sweeps;
    ASSERT_LT(early.bound, before) << sweeps;
    before = early.bound;
  }
}

TEST(TransportSolution, OfPatchesThatAbsorbNothingEndsWithoutABound) {
  Transport transport;
  transport.add_row({1, 1, 1}, std::vector<TransportEntry>{{1, Color{1, 1, 1}}});
  transport.add_row({0, 0, 0}, std::vector<TransportEntry>{{0, Color{1, 1, 1}}});
  RenderControl control;
  const TransportSolution solution = solve(transport, 1e-3, 50, control);
  EXPECT_EQ(solution.sweeps, 50u);
  EXPECT_EQ(solution.bound, std::numeric_limits<double>::infinity());
}

TEST(TransportSolution, IsLeftEarlyWhenCancelled) {
  RenderControl control;
  control.cancel();
  EXPECT_EQ(solve(goral(1, 0.5), 0, sweeps_max, control).sweeps, 0u);
}

TEST(TransportEntries, OfEqualPatchesAreAddedUp) {
  std::vector<TransportEntry> entries = {{2, Color{1, 0, 0}}, {0, Color{4, 4, 4}}, {2, Color{0, 2, 0}}};
  merge_entries(entries);
  ASSERT_EQ(entries.size(), 2u);
  EXPECT_EQ(entries[0].patch, 0u);
  EXPECT_EQ(entries[1].patch, 2u);
  EXPECT_EQ(entries[1].share(), (Color{1, 2, 0}));
}

}  // namespace
