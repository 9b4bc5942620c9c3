// The seam between samplers and integrators: samplers render with any tracer. Images of analytic tracers have means and
// errors in closed form.
#include "tracer/src/sampling/sampler.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>

#include "tests/support/scenes.h"
#include "tracer/src/sampling/brightest_pixel.h"

namespace tracer {
namespace {

/// Radiance is a function of the position in the image: no rays, no scene. `pieces`: parts of equal radiance are
/// surfaces, else there is one.
template <double (*radiance_at)(double x, double y), bool pieces = true>
class AnalyticTracer : public Tracer {
 public:
  AnalyticTracer(const CompiledScene& /*scene*/, const RenderControl& control, const Approximations& /*none*/)
      : control_(control) {}

  Batch& batch() override { return batch_; }
  bool trace() override {
    radiance_.clear();
    signatures_.clear();
    for (std::size_t i = 0; i < batch_.samples.size(); ++i) {
      const double value = radiance_at(batch_.x[i], batch_.y[i]);
      radiance_.push_back({value, value, value});
      signatures_.push_back(
          {.surface = pieces ? std::bit_cast<std::uint32_t>(static_cast<float>(value)) : 1, .normal = {0, 0, 127}});
    }
    statistics_.samples += radiance_.size();
    statistics_.rays.camera += radiance_.size();
    return !control_.cancelled();
  }
  const std::vector<Color>& radiance() const override { return radiance_; }
  const std::vector<float>& omitted() const override { return omitted_; }
  const std::vector<SampleSignature>& signatures() const override { return signatures_; }
  const GBuffer& gbuffer() const override { return gbuffer_; }
  const RenderStatistics& statistics() const override { return statistics_; }

 private:
  const RenderControl& control_;
  Batch batch_;
  std::vector<Color> radiance_;
  std::vector<SampleSignature> signatures_;
  std::vector<float> omitted_;
  GBuffer gbuffer_;
  RenderStatistics statistics_;
};

constexpr std::uint32_t side = 48;

double constant(double, double) { return 0.25; }
double ramp(double x, double y) { return 0.2 + 0.005 * x + 0.003 * y; }
/// An edge within the pixels of one column: they are 0.1 to the left of it and 0.7 to the right.
constexpr double edge_x = 20.3;
double edge(double x, double) { return x < edge_x ? 0.1 : 0.7; }
/// Mean over a pixel of column `x`.
double mean_of_edge(double x) {
  return x + 1 <= edge_x ? 0.1 : x >= edge_x ? 0.7 : 0.1 * (edge_x - x) + 0.7 * (x + 1 - edge_x);
}

/// A square around the center of one pixel.
double hot_square(double x, double y) { return std::max(std::abs(x - 20.5), std::abs(y - 20.5)) < 0.35 ? 8 : 0.25; }

/// An edge between radiances above white.
double bright_edge(double x, double) { return x < edge_x ? 2 : 4; }

std::shared_ptr<const CompiledScene> compiled(const Scene& scene) {
  RenderControl control;
  return *compile(scene, control);
}

template <auto sample, class T>
Rendered sampled(const CompiledScene& scene) {
  RenderControl control;
  return *sample(scene, {.threads = 1}, control, make<T>);
}

Scene uniform_scene(std::uint32_t samples) {
  Scene scene = scenes::empty(side);
  scene.accuracy.samples = samples;
  return scene;
}

Scene adaptive_scene(double target_error) {
  Scene scene = scenes::empty(side);
  scene.accuracy.target_error = target_error;
  scene.accuracy.adaptive.emplace().target_error = target_error;
  return scene;
}

/// Root mean square error in 8-bit code values.
template <class Mean>
double rms_error(const Rendered& rendered, const Mean& mean) {
  const DisplayTransform display({}, 1);
  double sum = 0;
  for (std::size_t i = 0; i < rendered.image.rgb.size(); ++i) {
    const std::size_t place = i / 3, row = place / side;
    const double expected = mean(static_cast<double>(place % side), static_cast<double>(row));
    sum += std::pow(display.level(rendered.image.rgb[i]) - display.level(expected), 2);
  }
  return std::sqrt(sum / static_cast<double>(rendered.image.rgb.size()));
}

TEST(UniformSampler, RendersAConstantExactlyWithoutError) {
  for (const std::uint32_t samples : {1u, 5u}) {
    const auto scene = compiled(uniform_scene(samples));
    const Rendered rendered = sampled<sample_uniformly, AnalyticTracer<constant>>(*scene);
    for (const float value : rendered.image.rgb) ASSERT_EQ(value, 0.25f);
    EXPECT_EQ(rendered.error.estimate, 0);
    EXPECT_EQ(rendered.statistics.samples, std::uint64_t{samples} * side * side);
  }
}

TEST(UniformSampler, RendersARampExactlyFromCenters) {
  const auto scene = compiled(uniform_scene(1));
  const Rendered rendered = sampled<sample_uniformly, AnalyticTracer<ramp, false>>(*scene);
  EXPECT_LT(rms_error(rendered, [](double x, double y) { return ramp(x + 0.5, y + 0.5); }), 1e-4);
}

TEST(UniformSampler, BoundsTheErrorOfAnEdge) {
  for (const std::uint32_t samples : {1u, 16u, 64u}) {
    const auto scene = compiled(uniform_scene(samples));
    const Rendered rendered = sampled<sample_uniformly, AnalyticTracer<edge>>(*scene);
    const double error = rms_error(rendered, [](double x, double) { return mean_of_edge(x); });
    EXPECT_LE(error, rendered.error.estimate) << samples;
    EXPECT_GT(rendered.error.estimate, 0) << samples;
    EXPECT_EQ(rendered.image.rgb[0], 0.1f);
    EXPECT_EQ(rendered.image.rgb[3 * side - 1], 0.7f);
  }
}

TEST(AdaptiveSampler, RefinesTheEdgeOnlyAndReachesTheTarget) {
  const double target = 0.4;
  const auto scene = compiled(adaptive_scene(target));
  const Rendered rendered = sampled<sample_adaptively, AnalyticTracer<edge>>(*scene);
  const double error = rms_error(rendered, [](double x, double) { return mean_of_edge(x); });
  EXPECT_TRUE(rendered.error.target_met);
  EXPECT_LE(rendered.error.estimate, target);
  EXPECT_LE(error, target);
  EXPECT_GT(rendered.statistics.samples_max, 4u);
  EXPECT_EQ(rendered.statistics.samples_min, 1u);
}

/// `overflow: scale` divides by the brightest pixel, which the pilot takes for 8 and which is 8 * 0.49.
TEST(AdaptiveSampler, DoesNotTrustAPilotThatIsBrighterThanItsPixel) {
  Scene source = adaptive_scene(4);
  source.output.overflow = Output::Overflow::scale;
  const auto scene = compiled(source);
  const Rendered rendered = sampled<sample_adaptively, AnalyticTracer<hot_square>>(*scene);
  const float brightest = *std::max_element(rendered.image.rgb.begin(), rendered.image.rgb.end());
  EXPECT_NEAR(brightest, 8 * 0.49, 0.2);
}

/// Without time for more samples, a bright pilot may be all that is bright.
TEST(AdaptiveSampler, ChargesToTheToneThatAPilotMayBeBrighterThanItsPixel) {
  Scene source = adaptive_scene(4);
  source.output.overflow = Output::Overflow::scale;
  source.accuracy.adaptive->samples_max = 1;
  const auto scene = compiled(source);
  const Rendered rendered = sampled<sample_adaptively, AnalyticTracer<hot_square>>(*scene);
  EXPECT_EQ(rendered.statistics.samples_max, 1u);
  const DisplayTransform found(source.output, 8), dark(source.output, 0.25);
  EXPECT_NEAR(rendered.error.tone, dark.level(0.25) - found.level(0.25), 1);
}

/// Levels are those of the image divided by its brightest channel: nothing in it is white but that.
TEST(AdaptiveSampler, RefinesAnEdgeAboveWhiteIfTheImageIsScaled) {
  Scene source = adaptive_scene(0.4);
  source.output.overflow = Output::Overflow::scale;
  const Rendered rendered = sampled<sample_adaptively, AnalyticTracer<bright_edge>>(*compiled(source));
  EXPECT_GT(rendered.statistics.samples_max, 1u);
  const float found = rendered.image.rgb[(std::size_t{20} * side + 20) * 3];
  EXPECT_NEAR(found, 2 * 0.3 + 4 * 0.7, 0.2);
}

/// `overflow: scale` divides by the brightest pixel, which may be one that shows a lamp between the samples.
TEST(UniformSampler, ChargesToTheToneWhatMirrorsMayShow) {
  double before = std::numeric_limits<double>::infinity();
  for (const std::uint32_t samples : {1u, 4u, 64u}) {
    Scene source = uniform_scene(samples);
    source.output.overflow = Output::Overflow::scale;
    scenes::add(source, Sphere{{0, 0, 1000}, 10}, scenes::glowing({100, 100, 100}));
    EXPECT_EQ((sampled<sample_uniformly, AnalyticTracer<constant>>(*compiled(source)).error.tone), 0) << samples;
    scenes::add(source, Sphere{{100, 0, 1000}, 10}, scenes::mirror(1));
    const double tone = sampled<sample_uniformly, AnalyticTracer<constant>>(*compiled(source)).error.tone;
    EXPECT_GT(tone, 1) << samples;
    EXPECT_LT(tone, before) << "more samples miss less";
    before = tone;
  }
}

TEST(AdaptiveSampler, StopsAtTheCentersOfARamp) {
  const auto scene = compiled(adaptive_scene(0.4));
  const Rendered rendered = sampled<sample_adaptively, AnalyticTracer<ramp, false>>(*scene);
  EXPECT_TRUE(rendered.error.target_met);
  EXPECT_LT(rms_error(rendered, [](double x, double y) { return ramp(x + 0.5, y + 0.5); }), 1e-2);
  EXPECT_EQ(rendered.statistics.samples_max, 1u);
}

/// Probability that a normal variable exceeds `deviations`.
double upper_tail(double deviations) { return std::erfc(deviations / std::numbers::sqrt2) / 2; }

TEST(BrightestRange, ContainsTheLargestOfManyMeansWith99Percent) {
  for (const double count : {1.0, 4.0, 100.0, 1e4, 1e6}) {
    const double tail = count * upper_tail(BrightestRange::deviations_of_largest(count));
    EXPECT_NEAR(tail, 0.01, 0.002) << count;
  }
}

TEST(BrightestRange, IsLowerBelowSelectedPixels) {
  BrightestRange range{.deviations_below = BrightestRange::deviations_of_largest(1000)};
  range.add(1, 0.01, 0, 0);
  EXPECT_DOUBLE_EQ(range.found, 1);
  EXPECT_DOUBLE_EQ(range.low, 1 - 0.01 * range.deviations_below);
  EXPECT_DOUBLE_EQ(range.high, 1 + 0.01 * BrightestRange::deviations);
}

}  // namespace
}  // namespace tracer
