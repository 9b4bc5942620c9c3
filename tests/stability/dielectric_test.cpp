// Glass with the index of air or a million, a camera inside of glass, glass in layers of zero thickness; the critical
// angle to the last bit.
#include <gtest/gtest.h>

#include <sstream>

#include "tests/stability/table.h"
#include "tests/support/effort.h"
#include "tests/support/long_vec.h"
#include "tests/support/random.h"
#include "tests/support/reference_optics.h"
#include "tracer/src/math/optics.h"

namespace {

using oracle::Random;
using oracle::Real;
using namespace tracer;
using stability::Oracle;
using stability::Row;

/// Result for a ray at cos_i: the reflected part, the part transmitted through the last layer and the cosine there (0
/// and 0 at total reflection).
struct Layered {
  Real back = 1, onward = 0, cos_onward = 0;
};

/// `indices` start with the ray's medium, at least one. Inter-reflections between two interfaces form a geometric
/// series; an interface has the same reflectance from both sides (Stokes 1849).
Layered through_layers(Real cos_i, const std::vector<Real>& indices) {
  const Real sine = indices.front() * std::sqrt((1 - cos_i) * (1 + cos_i));
  const auto cosine = [sine](Real n) { return std::sqrt(std::fmax(0.0L, (n - sine) * (n + sine))) / n; };
  Layered below{0, 1, cosine(indices.back())};
  for (std::size_t i = indices.size() - 1; i-- > 0;) {
    const Real n1 = indices[i], n2 = indices[i + 1];
    const bool total = sine >= n2;
    const Real f = total ? 1 : n1 == n2 ? 0 : oracle::reflectance(i == 0 ? cos_i : cosine(n1), cosine(n2), n1, n2);
    const Real series = 1 - f * below.back;
    below = {total ? 1 : f + (1 - f) * (1 - f) * below.back / series, total ? 0 : (1 - f) * below.onward / series,
             below.cos_onward};
  }
  return below;
}

/// Half-spaces below the given heights, under a gradient background from 0 below to 1 above.
struct Layer {
  double top, ior;
  int priority = 0;
};

Scene half_spaces(const std::vector<Layer>& layers, const Vec3& eye, const Vec3& look_at, double fov_deg) {
  Scene scene = scenes::empty(48, {eye, look_at, {0, 1, 0}, fov_deg});
  scene.background.gradient = Gradient{{1, 1, 1}, {0, 0, 0}};
  scene.accuracy.max_depth = 100;
  for (const Layer& layer : layers) {
    Material glass = scenes::glass(layer.ior);
    glass.priority = layer.priority;
    scenes::add(scene, Plane{{0, layer.top, 0}, {0, 1, 0}, {}}, glass);
  }
  return scene;
}

/// Compares the image with the closed form; `indices` start with the camera's medium, in the direction of `down`.
void compare(Row& row, const Scene& scene, const std::vector<Real>& indices, bool down, const std::string& what) {
  const Image image = stability::render(scene).image;
  for (std::uint32_t y = 0; y < image.height; ++y)
    for (std::uint32_t x = 0; x < image.width; ++x) {
      const Real height = oracle::through(scene, x, y).y, cos_i = std::fabs(height);
      Real expected = (1 + height) / 2;
      if ((height < 0) == down) {
        const Layered layered = through_layers(cos_i, indices);
        const Real side = down ? -1 : 1;
        expected = layered.back * (1 - side * cos_i) / 2 + layered.onward * (1 + side * layered.cos_onward) / 2;
      }
      row.expect(std::fabs(image.pixel(x, y)[0] - expected) <= 1e-6L,
                 what + " at " + std::to_string(x) + " " + std::to_string(y) + ": " +
                     std::to_string(image.pixel(x, y)[0]) + ", not " + std::to_string(expected));
    }
}

TEST(GlassOfExtremeIndex, ReflectsAndTransmitsByFresnelFromBothSides) {
  Row row(10, "ior 1 +- 1e-15, 1 +- 1e-9, 1e6, 1e-6, both sides", Oracle::closed_form, "pixels");
  for (const double ior : {1 + 1e-15, 1 - 1e-15, 1 + 1e-9, 1 - 1e-9, 1e6, 1e-6})
    for (const double fov : {150.0, 1e-3}) {
      const std::string what = "ior - 1 = " + std::to_string(ior - 1);
      compare(row, half_spaces({{0, ior}}, {0, 1, 0}, {0.1, 0, 0}, fov), {1, ior}, true, what + " from above");
      compare(row, half_spaces({{0, ior}}, {0, -1, 0}, {0.1, 0, 0}, fov), {ior, 1}, false, what + " from below");
    }
}

TEST(CameraInGlass, ReceivesTheFresnelTransmittanceThroughOneInterface) {
  Row row(12, "eye inside glass: one border, total reflection beyond the angle", Oracle::closed_form, "pixels");
  for (const double ior : {1.5, 2.4, 0.7, 1.0001})
    for (const double height : {1e-9, 1.0, 1e6})
      compare(row, half_spaces({{0, ior}}, {0, -height, 0}, {0.2 * height, 0, 0}, 140), {ior, 1}, false,
              "ior " + std::to_string(ior));
}

/// Compares the layers in the given and in the reverse order with the closed form for `indices`.
void compare_layers(Row& row, std::vector<Layer> layers, const std::vector<Real>& indices, const std::string& what) {
  for (const bool backwards : {false, true}) {
    if (backwards) std::reverse(layers.begin(), layers.end());
    Scene scene = half_spaces(layers, {0, 2, 0}, {0.5, 0, 0}, 60);
    scene.accuracy.cutoff = 1e-9;
    compare(row, scene, indices, true, what + (backwards ? ", backwards" : ""));
  }
}

TEST(LayersOfGlass, GiveOneImageForAnyThinGapOrOverlap) {
  Row row(15, "nested, hidden, parted, overlapping by 1 .. 1e-14: the limit's", Oracle::closed_form, "pixels");
  for (const double gap : {1.0, 1e-3, 1e-6, 1e-9, 1e-12, 1e-14}) {
    std::ostringstream text;
    text << " by " << gap;
    const std::string by = text.str();
    compare_layers(row, {{0, 1.5}, {-gap, 1.33, 1}}, {1, 1.5, 1.33}, "nested" + by);
    compare_layers(row, {{0, 1.5, 1}, {-gap, 1.33}}, {1, 1.5}, "hidden" + by);
    compare_layers(row, {{0, 1.5}, {-0.5, 1, 1}, {-0.5 - gap, 1.33, 2}}, {1, 1.5, 1, 1.33}, "parted" + by);
    compare_layers(row, {{gap, 1.33}, {0, 1.5, 1}}, {1, 1.33, 1.5}, "overlapping" + by);
  }
}

TEST(LayersOfGlass, AtTheSamePositionEqualTheFirstOne) {
  Row row(15, "borders in exactly one place: the first one's image", Oracle::closed_form, "pixels");
  row.note("not the limit's: no ray gets between them, so solids that touch must overlap by 1e-14 to be two");
  compare(row, half_spaces({{0, 1.5}, {0, 1.33, 1}}, {0, 2, 0}, {0.5, 0, 0}, 60), {1, 1.5}, true, "1.5 first");
  compare(row, half_spaces({{0, 1.33, 1}, {0, 1.5}}, {0, 2, 0}, {0.5, 0, 0}, 60), {1, 1.33}, true, "1.33 first");
}

TEST(LayersOfGlass, AreTheSameForBoxesAsForHalfSpaces) {
  Row row(15, "boxes side by side that overlap by 1 .. 1e-9", Oracle::closed_form, "pixels");
  for (const double overlap : {1.0, 1e-3, 1e-6, 1e-9}) {
    Scene scene = half_spaces({}, {0, 2, 0}, {0.05, 0, 0}, 30);
    scene.accuracy.cutoff = 1e-9;
    Material over = scenes::glass(1.5), under = scenes::glass(1.33);
    over.priority = 1;
    scenes::add(scene, Box{{-1e3, -2, -1e3}, {1e3, 0, 1e3}}, over);
    scenes::add(scene, Box{{-1e3, -4, -1e3}, {1e3, -2 + overlap, 1e3}}, under);
    compare(row, scene, {1, 1.5, 1.33, 1}, true, "overlap " + std::to_string(overlap));
  }
}

/// cos^2 of the refracted angle; below 0 at total reflection.
Real cos2_beyond(Real cos_i, Real n1, Real n2) { return 1 - (n1 / n2) * (n1 / n2) * (1 - cos_i) * (1 + cos_i); }

/// Power reflectance for a refracted cos^2 changed by `off`, the bound of its rounding error.
Real reflectance_near(Real cos_i, Real n1, Real n2, Real off) {
  const Real cos2_t = cos2_beyond(cos_i, n1, n2) + off;
  return cos2_t <= 0 ? 1 : oracle::reflectance(cos_i, std::sqrt(std::fmin(1.0L, cos2_t)), n1, n2);
}

TEST(CriticalAngle, IsContinuous) {
  Row reflectance(11, "critical angle +- 40 ulp: R, beside R at +- 4 roundings", Oracle::closed_form, "cosines");
  Row whole(11, "critical angle +- 40 ulp: R + T = 1 with T by its amplitudes", Oracle::conservation, "cosines");
  Random random(1);
  for (std::uint64_t i = 0; i < effort::cases(2'000); ++i) {
    const double n1 = random.chance(0.3) ? random.spread(3, 1e6) : random.in(1.0001, 3);
    const double n2 = random.in(0.4, n1 * 0.9999);
    double cos_i = std::sqrt((1 - n2 / n1) * (1 + n2 / n1));
    for (int ulp = 0; ulp < 40; ++ulp) cos_i = std::nextafter(cos_i, 0);
    double before = 1;
    for (int ulp = -40; ulp <= 40; ++ulp, cos_i = std::nextafter(cos_i, 1)) {
      const Interface found = dielectric_interface(cos_i, n1, n2);
      const Real error_bound = 16 * 0x1p-53L * (n1 / n2) * (n1 / n2);
      const Real high = reflectance_near(cos_i, n1, n2, -error_bound),
                 low = reflectance_near(cos_i, n1, n2, error_bound);
      // Continuous: no step is larger than that of the closed form over the error bound.
      reflectance.expect(found.reflectance <= high + 4e-16L && found.reflectance >= low - 4e-16L &&
                         std::fabs(found.reflectance - before) <= 2 * (high - low) + 4e-16L + (ulp == -40 ? 1 : 0));
      before = found.reflectance;
      const Real cos2_t = cos2_beyond(cos_i, n1, n2);
      Real transmitted = 0;
      if (cos2_t > 0) {
        const Real cos_t = std::sqrt(cos2_t);
        // The amplitudes of Born & Wolf 1999, eq. 1.5.20.
        const Real t_s = 2 * n1 * cos_i / (n1 * cos_i + n2 * cos_t), t_p = 2 * n1 * cos_i / (n2 * cos_i + n1 * cos_t);
        transmitted = n2 * cos_t / (n1 * cos_i) * (t_s * t_s + t_p * t_p) / 2;
      }
      whole.expect(std::fabs(found.reflectance + transmitted - 1) <= high - low + 4e-16L);
    }
  }
}

}  // namespace
