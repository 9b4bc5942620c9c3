// Rows of patches, which rays find, against form factors in closed form.
#include "tracer/src/compile/surface_rows.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <thread>

#include "tests/support/scenes.h"
#include "tracer/compile.h"

namespace tracer {
namespace {

constexpr double wanted_patches = 1500;
constexpr std::uint32_t row_rays = 256;

Material white(double reflectance = 1) {
  Material material = scenes::matte({1, 1, 1});
  material.ambient = 0;
  material.diffuse = reflectance;
  return material;
}

void add_white_rectangle(Scene& scene, const Vec3& corner, const Vec3& u, const Vec3& v) {
  Mesh mesh;
  mesh.positions = {corner, corner + u, corner + u + v, corner + v};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  scenes::add(scene, mesh, white());
}

/// White surfaces under a sky of radiance 1, so that every row sums to 1.
Scene under_a_sky() {
  Scene scene = scenes::empty(8);
  scene.accuracy.model = Accuracy::Model::global;
  scene.accuracy.max_depth = 1000;
  scene.accuracy.approximate.interreflection = Approximations::Interreflection::radiosity;
  scene.background.color = {1, 1, 1};
  return scene;
}

Scene unit_cube() {
  Scene scene = under_a_sky();
  scene.background.color = {};
  scenes::add(scene, Sphere{{0.5, 0.5, 0.5}, 1e-3}, scenes::glowing({1, 1, 1}));
  for (const double at : {0.0, 1.0}) {
    add_white_rectangle(scene, {0, 0, at}, {1, 0, 0}, {0, 1, 0});
    add_white_rectangle(scene, {at, 0, 0}, {0, 1, 0}, {0, 0, 1});
    add_white_rectangle(scene, {0, at, 0}, {1, 0, 0}, {0, 0, 1});
  }
  return scene;
}

/// Patches and their rows.
class Rows {
 public:
  explicit Rows(const Scene& scene, double wanted = wanted_patches) {
    RenderControl control;
    const auto compiled = std::const_pointer_cast<CompiledScene>(*compile(scene, control));
    scene_ = compiled;
    const Bounds bounds = finite_bounds(scene);
    const Vec3 low = scene_->frame.render_from_world(bounds.low), high = scene_->frame.render_from_world(bounds.high);
    const Region region{(low + high) * 0.5, length(high - low) * 0.5};
    patches_ = divide_surfaces(PatchPoints(*compiled, region, control), wanted, PatchGrid::none, control);
    const auto radiosity = std::make_shared<Radiosity>();
    radiosity->patches = patches_.grid;
    compiled->objects.radiosity = radiosity;
    const SurfaceRows rows = trace_rows(*compiled, patches_.points, row_rays, control);
    for (std::size_t i = 0; i < rows.halves[0].size(); ++i) {
      std::vector<TransportEntry> row;
      for (const Transport& half : rows.halves)
        for (const TransportEntry& entry : half.row(i)) row.emplace_back(entry.patch, entry.share() * 0.5);
      merge_entries(row);
      transport_.add_row((rows.halves[0].source(i) + rows.halves[1].source(i)) * 0.5, row);
    }
  }

  [[nodiscard]] const CompiledScene& scene() const { return *scene_; }
  [[nodiscard]] const SurfacePatches& patches() const { return patches_; }
  [[nodiscard]] const Transport& transport() const { return transport_; }

  struct Factor {
    double value = 0, sigma = 0, area = 0;  ///< area: relative
  };
  /// Share of the light of `from` that arrives at `to`, of surfaces that face each other.
  template <class From, class To>
  [[nodiscard]] Factor factor(const From& is_from, const To& is_to) const {
    Factor factor;
    double rays = 0;
    for (std::size_t i = 0; i < patches_.points.size(); ++i) {
      if (!is_from(patches_.points[i].front())) continue;
      const auto area = static_cast<double>(patches_.points[i].size());
      double share = 0;
      for (const TransportEntry& entry : transport_.row(i))
        if (is_to(patches_.points[entry.patch].front())) share += entry.g;
      factor.value += area * share;
      factor.area += area;
      rays += row_rays;
    }
    factor.value /= factor.area;
    // For independent rays and the random areas of the patches.
    factor.sigma = std::sqrt(factor.value * (1 - factor.value) / rays) + factor.value * 0.2 / std::sqrt(factor.area);
    return factor;
  }
  [[nodiscard]] Factor factor(std::uint32_t from, std::uint32_t to) const {
    return factor([&](const PatchPoint& at) { return at.object == from; },
                  [&](const PatchPoint& at) { return at.object == to; });
  }

 private:
  std::shared_ptr<const CompiledScene> scene_;
  SurfacePatches patches_;
  Transport transport_;  ///< mean of both halves
};

void expect_factor(const Rows::Factor& factor, double truth) {
  EXPECT_NEAR(factor.value, truth, 3 * factor.sigma) << "sigma " << factor.sigma;
  EXPECT_LT(factor.sigma, 0.012 * truth);
}

TEST(SurfaceRows, SumToOneInAWhiteScene) {
  Scene spheres = under_a_sky(), smooth_mesh = under_a_sky();
  scenes::add(spheres, Sphere{{0, 0, 0}, 1}, white());
  scenes::add(spheres, Sphere{{2, 0.5, 0}, 1}, white());
  scenes::add(smooth_mesh, scenes::placed(scenes::icosphere(2, true), 1, {2, 0.5, 0}), white());
  Scene closed = unit_cube();
  Material& lamp = closed.materials[closed.objects[0].material.index];
  lamp = white();
  lamp.emission = Color{0, 0, 1};  // the sums are those of red
  for (const Scene& scene : {closed, spheres, smooth_mesh}) {
    const Rows rows(scene);
    ASSERT_GT(rows.transport().size(), 500u);
    for (std::size_t i = 0; i < rows.transport().size(); ++i) {
      double sum = rows.transport().source(i).r;
      for (const TransportEntry& entry : rows.transport().row(i)) sum += entry.r;
      ASSERT_LE(sum, 1 + 1e-12) << i;
      // Rays below the face, of a direction about the smooth normal, bring nothing.
      const bool smooth = scene.objects.size() == 1;
      ASSERT_GE(sum, smooth ? 0.9 : 1 - 1e-12) << i;
    }
  }
}

TEST(SurfaceRows, OfTheFacesOfACubeAreTheirFormFactors) {
  const Rows rows(unit_cube());
  constexpr double parallel = 0.199824895698387, perpendicular = 0.200043776075403;  // Howell C-11, C-14
  for (std::uint32_t from = 1; from <= 6; ++from) {
    double sum = 0;
    for (std::uint32_t to = 1; to <= 6; ++to) {
      const bool opposite = from != to && (from - 1) % 3 == (to - 1) % 3;
      const Rows::Factor factor = rows.factor(from, to);
      sum += factor.value;
      if (from == to) {
        EXPECT_NEAR(factor.value, 0, 0.0002);  // by places at edges that have no patch
      } else {
        expect_factor(factor, opposite ? parallel : perpendicular);
      }
    }
    EXPECT_NEAR(sum, 1, 0.001);  // the lamp takes a little
  }
}

TEST(SurfaceRows, OfPerpendicularRectanglesAreReciprocal) {
  Scene scene = under_a_sky();
  add_white_rectangle(scene, {0, 0, 0}, {1, 0, 0}, {0, 2, 0});
  add_white_rectangle(scene, {0, 0, 0}, {1, 0, 0}, {0, 0, 1});
  const Rows rows(scene);
  const auto floor = [](const PatchPoint& at) { return at.object == 0 && at.outward.z > 0; };
  const auto wall = [](const PatchPoint& at) { return at.object == 1 && at.outward.y > 0; };
  expect_factor(rows.factor(floor, wall), 0.116426301397681);
  expect_factor(rows.factor(wall, floor), 0.232852602795362);
}

TEST(SurfaceRows, OfDiscsAndSpheresAreTheirFormFactors) {
  Scene discs = under_a_sky();
  scenes::add(discs, Disc{.center = {0, 0, 0}, .normal = {0, 0, 1}, .radius = 1, .u_axis = {}}, white());
  scenes::add(discs, Disc{.center = {0, 0, 1}, .normal = {0, 0, 1}, .radius = 1, .u_axis = {}}, white());
  const auto upper_side = [](const PatchPoint& at) { return at.object == 0 && at.outward.z > 0; };
  const auto lower_side = [](const PatchPoint& at) { return at.object == 1 && at.outward.z < 0; };
  expect_factor(Rows(discs).factor(upper_side, lower_side), 0.381966011250105);

  Scene sphere = under_a_sky();
  scenes::add(sphere, Sphere{{0, 0, 2}, 1}, white());
  scenes::add(sphere, Disc{.center = {0, 0, 0}, .normal = {0, 0, 1}, .radius = 2, .u_axis = {}}, white());
  const Rows rows(sphere, 4000);
  const auto ball = [](const PatchPoint& at) { return at.object == 0; };
  const auto disc = [](const PatchPoint& at) { return at.object == 1 && at.outward.z > 0; };
  expect_factor(rows.factor(ball, disc), 0.146446609406726);
  // A_1 F_12 = A_2 F_21 for 4 pi and 4 pi.
  expect_factor(rows.factor(disc, ball), 0.146446609406726);
}

/// Mean over the patches of what arrives there by way of surfaces, with the rows multiplied by a factor.
double mean_arriving(const Transport& rows, double factor) {
  Transport multiplied;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    std::vector<TransportEntry> row(rows.row(i).begin(), rows.row(i).end());
    for (TransportEntry& entry : row) entry = {entry.patch, entry.share() * factor};
    multiplied.add_row(rows.source(i), row);
  }
  RenderControl control;
  double sum = 0;
  for (const Color& value : solve(multiplied, 1e-9, 1000, control).values) sum += value.g;
  return sum / static_cast<double>(rows.size());
}

TEST(SurfaceRows, TimesOneAndAFiftiethAreCaughtInAnIntegratingSphere) {
  constexpr double rho = 0.8, intensity = 2, radius = 1.5;
  Scene scene = under_a_sky();
  scene.background.color = {};
  scenes::add(scene, Sphere{{0, 0, 0}, radius}, white(rho));
  scene.lights.push_back(scenes::point_light({0.5, 0.2, 0}, {intensity, intensity, intensity}));
  scene.lights.back().attenuation.kind = Attenuation::Kind::inverse_square;
  const Rows rows(scene);
  const double truth = rho * intensity / (radius * radius * (1 - rho));
  EXPECT_NEAR(mean_arriving(rows.transport(), 1), truth, 0.005 * truth);
  EXPECT_GT(mean_arriving(rows.transport(), 1.02), 1.05 * truth) << "this fault could not be found";
}

TEST(SurfaceRows, MoveTheProgressAndEndSoonAfterCancellation) {
  const Rows few(unit_cube(), 300);
  constexpr std::size_t repetitions = 100;
  std::vector<std::vector<PatchPoint>> many;
  for (std::size_t i = 0; i < repetitions; ++i)
    many.insert(many.end(), few.patches().points.begin(), few.patches().points.end());
  RenderControl control;
  SurfaceRows rows;
  std::thread tracing([&] { rows = trace_rows(few.scene(), many, row_rays, control); });
  double progress = 0;
  while (progress == 0) {
    std::this_thread::yield();
    progress = control.progress();
  }
  control.cancel();
  tracing.join();
  EXPECT_LT(progress, 0.05) << "before half of the rows";
  EXPECT_LT(rows.rays, row_rays * many.size() / 2) << "seconds of rows";
  for (const Transport& half : rows.halves) EXPECT_EQ(half.size(), 0u);
  const TransportSolution solution = solve(few.transport(), 0, 1000, control);
  EXPECT_EQ(solution.sweeps, 0u);
}

TEST(SurfacePatches, KeepWithinTheLimit) {
  RenderControl control;
  const auto compiled = *compile(unit_cube(), control);
  const Region region{compiled->frame.render_from_world(Vec3{0.5, 0.5, 0.5}), compiled->frame.render_from_world(1.0)};
  using Divided = std::pair<std::size_t, bool>;  // number of patches; limited
  const auto divide = [&](double wanted, std::size_t patches_max) -> Divided {
    const SurfacePatches patches = divide_surfaces(PatchPoints(*compiled, region, control), wanted,
                                                   static_cast<std::uint32_t>(patches_max), control);
    EXPECT_EQ(patches.points.size(), patches.grid.size());
    return {patches.points.size(), patches.limited};
  };
  const auto [all, all_limited] = divide(600, 10'000);
  EXPECT_FALSE(all_limited);
  ASSERT_GT(all, 500u);
  EXPECT_EQ(divide(600, all), Divided(all, false)) << "at the limit";
  const auto [larger, limited] = divide(600, all - 1);
  EXPECT_TRUE(limited);
  EXPECT_LT(larger, all);
  EXPECT_GT(larger, all / 3) << "larger patches, not missing ones";
  const auto [most, most_limited] = divide(100'000, 600);
  EXPECT_LE(most, 600u);
  EXPECT_TRUE(most_limited);
  EXPECT_EQ(divide(600, 5), Divided(5, true)) << "a cube has six sides";
}

}  // namespace
}  // namespace tracer
