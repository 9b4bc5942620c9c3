// Repeated timings of a measurement, with clocks that count instead of measuring.
#include <gtest/gtest.h>

#include <algorithm>

#include "tests/support/random.h"
#include "tests/support/scenes.h"
#include "tracer/measure.h"

namespace {

using tracer::MeasuredPoint;
using tracer::MeasurementRun;

tracer::Scene ball() {
  tracer::Scene scene = scenes::empty(8);
  scenes::add(scene, tracer::Sphere{}, scenes::matte({1, 1, 1}));
  scene.lights.push_back(scenes::directional_light({0, 0, -1}));
  return scene;
}

/// A clock that advances at each reading: a run, which reads it twice, takes one advance.
template <class Advance>
std::function<double()> clock_of(Advance advance) {
  return [advance, now = 0.0]() mutable { return now += advance(); };
}

tracer::MeasureSettings settings(std::function<double()> seconds) {
  return {.parameters = {"samples"}, .reference_samples = 16, .threads = 1, .seconds = std::move(seconds)};
}

void complete_reference(MeasurementRun& run) {
  tracer::RenderControl control;
  while (!run.reference().complete) ASSERT_FALSE(run.step(control).has_value());
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

std::vector<std::size_t> run_counts(const std::vector<MeasuredPoint>& points) {
  std::vector<std::size_t> counts;
  for (const MeasuredPoint& point : points) counts.push_back(point.runs.size());
  return counts;
}

TEST(MeasurementRun, RepeatsTimingsOnceIfTheyAreExact) {
  const tracer::Scene scene = ball();
  MeasurementRun run(scene, {}, settings(clock_of([] { return 0.5; })));
  EXPECT_EQ(run_counts(measure(run)), (std::vector<std::size_t>{2, 2, 2, 2}));
}

/// Settings alternate between `seconds` and twice as many from render to render, and each of them from round to round.
tracer::Measurement measure_alternating_times(double seconds) {
  const tracer::Scene scene = ball();
  std::size_t readings = 0;
  const auto advance = [&] {
    const std::size_t render = readings++ / 2, round = render / 4;
    return (render + round) % 2 == 0 ? seconds : 2 * seconds;
  };
  MeasurementRun run(scene, {}, settings(clock_of(advance)));
  complete_reference(run);
  readings = 0;
  measure(run);
  return run.measurement();
}

TEST(MeasurementRun, RepeatsUncertainTimingsUpToTheLimit) {
  const tracer::Measurement measured = measure_alternating_times(0.25);
  EXPECT_EQ(run_counts(measured.points), std::vector<std::size_t>(4, tracer::timing_runs_max));
  const auto sentences = tracer::advice(measured);
  EXPECT_TRUE(std::ranges::any_of(
      sentences, [](const std::string& sentence) { return sentence.starts_with("the order in time is uncertain"); }));
}

TEST(MeasurementRun, RepeatsLongTimingsForTwiceTheirTime) {
  EXPECT_EQ(run_counts(measure_alternating_times(10).points), std::vector<std::size_t>(4, 3));
}

TEST(MeasurementRun, StopsWhenTheTimesDifferByMoreThanTheirNoise) {
  const tracer::Scene scene = ball();
  oracle::Random random(1);
  std::size_t readings = 0;
  // The settings of a round take 1, 2, 3 and 4 seconds, and up to a tenth of a second more.
  const auto advance = [&] { return 1 + static_cast<double>(readings++ / 2 % 4) + random.in(0, 0.1); };
  MeasurementRun run(scene, {}, settings(clock_of(advance)));
  complete_reference(run);
  readings = 0;
  const auto points = measure(run);
  EXPECT_EQ(run_counts(points), (std::vector<std::size_t>{2, 2, 2, 2}));
  EXPECT_TRUE(std::ranges::is_sorted(points, {}, &MeasuredPoint::seconds));
}

TEST(MeasurementRun, ReportsTheFastestRun) {
  const tracer::Scene scene = ball();
  oracle::Random random(2);
  MeasurementRun run(scene, {}, settings(clock_of([&] { return random.in(1, 2); })));
  for (const MeasuredPoint& point : measure(run)) EXPECT_EQ(point.seconds, std::ranges::min(point.runs));
}

TEST(MeasurementRun, RendersAShortRunSeveralTimes) {
  const tracer::Scene scene = ball();
  std::size_t readings = 0;
  const auto points_with = [&](double seconds) {
    MeasurementRun run(scene, {}, settings(clock_of([&readings, seconds] {
                         ++readings;
                         return seconds;
                       })));
    complete_reference(run);
    readings = 0;
    return measure(run);
  };
  EXPECT_EQ(run_counts(points_with(1)), (std::vector<std::size_t>{2, 2, 2, 2}));
  EXPECT_EQ(readings, 2 * 4 * 2u) << "a start and an end of two runs of four settings";
  EXPECT_EQ(run_counts(points_with(0x1p-7)), (std::vector<std::size_t>{2, 2, 2, 2}));
  EXPECT_EQ(readings, 2 * 4 * (1 + 3 + 3u)) << "an image, and two runs of three renders in a fiftieth of a second";
  EXPECT_EQ(run_counts(points_with(0)), (std::vector<std::size_t>{2, 2, 2, 2})) << "a clock that stands still";
}

TEST(MeasurementRun, ResumesWithTheRunsOfEarlierPoints) {
  const tracer::Scene scene = ball();
  const auto exact = [] { return 0.5; };
  MeasurementRun first(scene, {}, settings(clock_of(exact)));
  const auto points = measure(first);
  MeasurementRun second(scene, {}, settings(clock_of(exact)));
  second.resume(first.reference());
  second.resume(points);
  EXPECT_TRUE(second.done());
  EXPECT_EQ(run_counts(second.measurement().points), run_counts(points));
}

TEST(MeasurementRun, KeepsItsResultsWhenCancelled) {
  const tracer::Scene scene = ball();
  MeasurementRun run(scene, {}, settings(clock_of([] { return 0.5; })));
  tracer::RenderControl control;
  while (run.measurement().points.size() < 4) ASSERT_FALSE(run.step(control).has_value());
  control.cancel();
  EXPECT_TRUE(run.step(control).has_value());
  EXPECT_EQ(run_counts(run.measurement().points), (std::vector<std::size_t>{1, 1, 1, 1}));
  EXPECT_FALSE(run.done());
  EXPECT_EQ(run_counts(measure(run)), (std::vector<std::size_t>{2, 2, 2, 2}));
}

}  // namespace
