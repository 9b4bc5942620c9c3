// Repeated timings of a measurement, with clocks that count instead of measuring.
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/random.h"
#include "tests/support/scenes.h"
#include "tracer/measure.h"

namespace {

using tracer::MeasuredPoint;
using tracer::MeasurementRun;

using Counts = std::vector<std::size_t>;

const tracer::Scene ball = [] {
  tracer::Scene scene = scenes::empty(8);
  scenes::add(scene, tracer::Sphere{}, scenes::matte({1, 1, 1}));
  scene.lights.push_back(scenes::directional_light({0, 0, -1}));
  return scene;
}();

tracer::MeasureSettings settings(std::function<double()> seconds) {
  return {.parameters = {"samples"}, .reference_samples = 16, .threads = 1, .seconds = std::move(seconds)};
}

/// Every run takes half a second.
tracer::MeasureSettings exact_settings() {
  return settings([now = 0.0]() mutable { return now += 0.5; });
}

/// Takes all remaining steps and checks the progress.
std::vector<MeasuredPoint> measure(MeasurementRun& run) {
  tracer::RenderControl control;
  std::size_t before = run.steps_done();
  while (!run.done()) {
    EXPECT_FALSE(run.next().empty());
    EXPECT_FALSE(run.step(control).has_value());
    EXPECT_GE(run.steps_done(), before);
    EXPECT_LE(run.steps_done(), run.steps());
    before = run.steps_done();
  }
  EXPECT_EQ(run.steps_done(), run.steps());
  return run.measurement().points;
}

/// A measurement whose clock advances by `advance(n)` at the reading n after the reference: the render n / 2, which
/// reads it twice, takes as long as its second advance.
template <class Advance>
std::vector<MeasuredPoint> measure_with(const Advance& advance) {
  std::size_t readings = 0;
  MeasurementRun run(ball, {}, settings([&, now = 0.0]() mutable { return now += advance(readings++); }));
  tracer::RenderControl control;
  while (!run.reference().complete) EXPECT_FALSE(run.step(control).has_value());
  readings = 0;
  return measure(run);
}

Counts run_counts(const std::vector<MeasuredPoint>& points) {
  Counts counts;
  for (const MeasuredPoint& point : points) counts.push_back(point.runs.size());
  return counts;
}

TEST(MeasurementRun, RepeatsUncertainTimingsForTwiceTheirTimeAndUpToTheLimit) {
  for (const auto& [seconds, runs] : {std::pair{0.25, tracer::timing_runs_max}, {10.0, 3u}}) {
    // Settings alternate between `seconds` and twice as many from render to render, and each of them from round to
    // round.
    const auto advance = [shorter = seconds](std::size_t reading) {
      const std::size_t render = reading / 2, round = render / 4;
      return (render + round) % 2 == 0 ? shorter : 2 * shorter;
    };
    EXPECT_EQ(run_counts(measure_with(advance)), Counts(4, runs)) << seconds << " s";
  }
}

TEST(MeasurementRun, StopsWhenTheTimesDifferByMoreThanTheirNoise) {
  oracle::Random random(1);
  // The settings of a round take 1, 2, 3 and 4 seconds, and up to a tenth of a second more.
  const auto points =
      measure_with([&](std::size_t reading) { return 1 + static_cast<double>(reading / 2 % 4) + random.in(0, 0.1); });
  EXPECT_EQ(run_counts(points), Counts(4, 2));
  EXPECT_TRUE(std::ranges::is_sorted(points, {}, &MeasuredPoint::seconds));
}

TEST(MeasurementRun, ReportsTheFastestRun) {
  oracle::Random random(2);
  for (const MeasuredPoint& point : measure_with([&](std::size_t) { return random.in(1, 2); }))
    EXPECT_EQ(point.seconds, std::ranges::min(point.runs));
}

TEST(MeasurementRun, RendersAShortRunSeveralTimes) {
  std::size_t readings = 0;
  const auto counts_with = [&](double seconds) {
    return run_counts(measure_with([&](std::size_t reading) {
      readings = reading + 1;
      return seconds;
    }));
  };
  EXPECT_EQ(counts_with(1), Counts(4, 2));
  EXPECT_EQ(readings, 2 * 4 * 2u) << "a start and an end of two runs of four settings";
  EXPECT_EQ(counts_with(0x1p-7), Counts(4, 2));
  EXPECT_EQ(readings, 2 * 4 * (1 + 3 + 3u)) << "an image, and two runs of three renders in a fiftieth of a second";
  EXPECT_EQ(counts_with(0), Counts(4, 2)) << "a clock that stands still";
}

TEST(MeasurementRun, ResumesWithTheRunsOfEarlierPoints) {
  MeasurementRun first(ball, {}, exact_settings()), second(ball, {}, exact_settings());
  const auto points = measure(first);
  second.resume(first.reference());
  second.resume(points);
  EXPECT_TRUE(second.done());
  EXPECT_EQ(run_counts(second.measurement().points), run_counts(points));
}

TEST(MeasurementRun, KeepsItsResultsWhenCancelledAndRepeatsExactTimingsOnce) {
  MeasurementRun run(ball, {}, exact_settings());
  tracer::RenderControl control;
  while (run.measurement().points.size() < 4) ASSERT_FALSE(run.step(control).has_value());
  control.cancel();
  EXPECT_TRUE(run.step(control).has_value());
  EXPECT_EQ(run_counts(run.measurement().points), Counts(4, 1));
  EXPECT_FALSE(run.done());
  EXPECT_EQ(run_counts(measure(run)), Counts(4, 2));
}

}  // namespace
