// Pareto front and advice of synthetic points.
#include "tracer/measurement.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace {

using tracer::MeasuredPoint;
using tracer::Measurement;
using Indices = std::vector<std::size_t>;

/// A point with three equal runs.
MeasuredPoint point(const char* parameter, const char* value, double seconds, double error, double claimed = 100) {
  MeasuredPoint point;
  point.setting = {parameter, value, {}};
  point.seconds = seconds;
  point.runs.assign(3, seconds);
  point.error = error;
  point.claimed.estimate = claimed;
  return point;
}

Measurement measurement(std::vector<MeasuredPoint> points) {
  Measurement measurement;
  measurement.points = std::move(points);
  return measurement;
}

bool contains_part(const Measurement& measurement, const std::string& part) {
  return std::ranges::any_of(tracer::advice(measurement),
                             [&](const std::string& sentence) { return sentence.find(part) != std::string::npos; });
}

void expect_advice(const Measurement& measurement, const std::string& sentence) {
  const auto sentences = tracer::advice(measurement);
  EXPECT_EQ(std::ranges::count(sentences, sentence), 1)
      << sentence << "\nadvice: " << testing::PrintToString(sentences);
}

TEST(ParetoFront, HasTheNonDominatedPointsFastestFirst) {
  const auto timed = [](double seconds, double error, double claimed) {
    return point("a", "1", seconds, error, claimed);
  };
  struct Case {
    const char* name;
    std::vector<MeasuredPoint> points;
    Indices front;
  };
  const Case cases[] = {
      {"none", {}, {}},
      {"slow and exact, dominated, fast and rough, as slow but rougher, between",
       {timed(9, 0, 0.1), timed(9.5, 0, 5), timed(1, 0, 8), timed(9, 0, 0.2), timed(3, 0, 2)},
       {2, 4, 0}},
      {"the claim counts instead of the true error", {timed(1, 0.1, 4), timed(1, 3, 3.5)}, {1}},
      {"no broken claim", {timed(1, 3, 0.5), timed(2, 0.5, 1)}, {1}},
      {"the first of equal points", {timed(1, 0, 2), timed(1, 0, 2), timed(2, 0, 2)}, {0}},
  };
  for (const Case& each : cases) EXPECT_EQ(tracer::pareto_front(measurement(each.points)), each.front) << each.name;
}

TEST(ParetoFront, ContainsNoPointThatIsFasterOnlyByNoise) {
  auto measured = measurement({point("a", "1", 1, 0, 2), point("a", "2", 0.98, 0, 2.5), point("a", "3", 0.5, 0, 3)});
  EXPECT_EQ(tracer::pareto_front(measured), (Indices{2, 1, 0}));
  measured.points[1].runs = {0.98, 1.01, 1};
  EXPECT_EQ(tracer::pareto_front(measured), (Indices{2, 0}));
}

TEST(ParetoFront, HasTheFirstOfEqualClaimsUnlessAnotherIsFasterForCertain) {
  auto measured = measurement({point("a", "1", 1, 0, 2), point("a", "2", 0.8, 0, 2)});
  EXPECT_EQ(tracer::pareto_front(measured), Indices{1});
  measured.points[1].runs = {0.8, 1.1, 0.9};
  EXPECT_EQ(tracer::pareto_front(measured), Indices{0});
  measured.points[1].claimed.estimate = 2.5;  // the fastest runs decide
  EXPECT_EQ(tracer::pareto_front(measured), (Indices{1, 0}));
}

TEST(BrokenClaim, IsATrueErrorAboveTheClaimByMoreThanTheReferencesError) {
  Measurement measured = measurement({point("a", "1", 1, 2.5, 2)});
  EXPECT_TRUE(is_broken(measured, measured.points[0]));
  measured.reference_error = 0.5;
  EXPECT_FALSE(is_broken(measured, measured.points[0]));
  measured.points[0].error = 2.6;
  EXPECT_TRUE(is_broken(measured, measured.points[0]));
}

/// The point with upper limits of these errors.
MeasuredPoint limited(MeasuredPoint measured, std::vector<std::string> errors = {"error"}) {
  measured.upper_limits = std::move(errors);
  return measured;
}

/// The point with an approximation; points without one have the accuracy of the exact render.
MeasuredPoint approximate(MeasuredPoint measured) {
  measured.setting.accuracy.approximate.shadows = tracer::Approximations::Shadows::none;
  return measured;
}

TEST(ParetoFront, ContainsNoApproximationThatIsNotFasterForCertain) {
  const MeasuredPoint exact = point("samples", "16", 1, 1, 2);
  const auto front_with = [&](double seconds, double claimed, std::vector<double> runs) {
    Measurement measured =
        measurement({exact, approximate(point("approximate", "shadows: none", seconds, 1, claimed))});
    if (!runs.empty()) measured.points[1].runs = std::move(runs);
    return tracer::pareto_front(measured);
  };
  EXPECT_EQ(front_with(0.5, 3, {}), (Indices{1, 0}));
  EXPECT_EQ(front_with(1.5, 1, {}), Indices{0}) << "slower, whatever it claims";
  EXPECT_EQ(front_with(1, 1, {}), Indices{0});
  EXPECT_EQ(front_with(0.9, 1, {0.9, 1.3, 1}), Indices{0}) << "an uncertain order";
  Measurement alone = measurement({approximate(point("approximate", "shadows: none", 1, 1, 2))});
  EXPECT_EQ(tracer::pareto_front(alone), Indices{0}) << "the exact render was not measured";
}

TEST(UpperLimit, IsNamedAndComparedWithNothing) {
  Measurement measured =
      measurement({limited(point("samples", "16", 2, 2, 5)), point("approximate", "shadows: map", 1, 4, 5),
                   limited(point("approximate", "shadows: none", 0.5, 2, 6)), point("cutoff", "0.1", 3, 2.01, 6),
                   limited(point("cutoff", "0.01", 3, 2, 6)), limited(point("cutoff", "0.001", 3, 2, 6))});
  measured.reference_error = 2;
  const auto sentences = tracer::advice(measured);
  EXPECT_EQ(sentences[0],
            "for 4 levels: no setting, the best is approximate shadows: map, 1.0 s, claimed error 5.0 levels");
  expect_advice(measured,
                "the true error was within the claimed one in all 2 settings; the other errors are below that of "
                "the reference and unknown");
  expect_advice(measured, "shadows: map saves 50 % and has a true error 4.0 levels");
  expect_advice(measured, "shadows: none saves 75 % and has a true error at most 2.0 levels");
  for (const std::string& sentence : sentences) EXPECT_FALSE(sentence.starts_with("cutoff")) << sentence;
}

TEST(Chart, MarksUpperLimits) {
  const tracer::Plot plot = tracer::chart(measurement({limited(point("samples", "1", 1, 2, 2))}));
  EXPECT_EQ(plot.series.back().points.at(0).label, "1 (at most)");
}

TEST(Chart, DrawsBrokenClaimsAsASeriesOfTheirOwn) {
  const auto errors_of = [](const Measurement& measured, const char* name) {
    std::vector<double> errors;
    for (const tracer::PlotSeries& series : tracer::chart(measured).series)
      for (const tracer::PlotPoint& point : series.points)
        if (series.name == name) errors.push_back(point.y);
    return errors;
  };
  const auto kept = point("samples", "4", 2, 0.5, 1);
  const auto measured = measurement({point("samples", "1", 1, 3, 0.5), kept});
  EXPECT_EQ(errors_of(measured, "broken claim"), (std::vector{0.5, 3.0}));
  EXPECT_EQ(errors_of(measured, "claimed"), (std::vector{1.0, 0.5}));
  EXPECT_TRUE(errors_of(measurement({kept}), "broken claim").empty());
}

TEST(Advice, DescribesThePoints) {
  EXPECT_TRUE(tracer::advice({}).empty());
  const std::pair<std::vector<MeasuredPoint>, const char*> cases[] = {
      {{point("target_error", "4", 0.125, 3.1, 3.5), point("samples", "1", 0.25, 0.1, 3.6),
        point("target_error", "1", 0.4, 0.6, 0.99), point("target_error", "0.5", 2, 0.25, 0.5)},
       "for 4 levels: target_error 4, 0.12 s, true error 3.1 levels; for 1 level: target_error 1, 0.40 s, true error "
       "0.60 levels; for 0.5 levels: target_error 0.5, 2.0 s, true error 0.25 levels"},
      {{limited(point("samples", "1", 1, 2, 2))},
       "for 4 levels: samples 1, 1.0 s, true error at most 2.0 levels; for 1 level: no setting, the best is samples 1, "
       "1.0 s, claimed error 2.0 levels"},
      {{point("samples", "1", 0.2, 2, 0.5), point("samples", "4", 0.8, 2, 3)},
       "for 4 levels: samples 4, 0.80 s, true error 2.0 levels; for 1 level: no setting, the best is samples 4, 0.80 "
       "s, claimed error 3.0 levels"},
      {{point("samples", "1", 0.2, 2, 0.5)}, "for 4 levels: no setting, all claims are broken"},
      {{point("samples", "1", 1, 2, 2)}, "the true error was within the claimed one in all 1 settings"},
      {{limited(point("samples", "1", 1, 2, 2))}, "all true errors are below that of the reference and unknown"},
      {{point("samples", "1", 1, 6, 5), point("samples", "4", 2, 12.5, 1.875)},
       "the true error was above the claimed one in 2 of 2 settings, by the largest factor with samples 4: 12.5 "
       "levels, claimed 1.88 levels"},
      {{point("cutoff", "0.1", 1, 5), point("cutoff", "0.01", 1, 1.04), point("cutoff", "0.001", 1, 1.01),
        point("cutoff", "0.0001", 2, 1)},
       "cutoff below 0.01 does not reduce the error"},
      {{point("max_depth", "4", 1, 5), point("max_depth", "8", 1, 2)},
       "max_depth 8 still reduces the error: 2.0 levels instead of 5.0 with 4"},
  };
  for (const auto& [points, sentence] : cases) expect_advice(measurement(points), sentence);
}

TEST(Advice, NamesSettingsWhoseOrderInTimeIsUncertain) {
  auto measured =
      measurement({point("samples", "1", 1, 1), point("samples", "4", 1.2, 1), point("samples", "16", 9, 1)});
  EXPECT_FALSE(contains_part(measured, "uncertain"));
  measured.points[1].runs = {1.2, 2, 1.3};
  expect_advice(measured, "the order in time is uncertain of samples 1, samples 4");
  for (tracer::MeasuredPoint& point : measured.points) point.runs = {1};
  measured.points.resize(5, measured.points[0]);
  expect_advice(measured, "the order in time is uncertain of samples 1, samples 4 and 3 other settings");
}

TEST(Advice, ReportsGainAndCostOfApproximations) {
  auto measured =
      measurement({point("samples", "16", 2, 1), point("approximate", "shadows: map", 1.4, 4.1),
                   point("approximate", "shadows: none", 2.5, 1.01), point("approximate", "shading: flat", 1.99, 3)});
  expect_advice(measured, "shadows: map saves 30 % and costs 3.1 levels");
  expect_advice(measured, "shadows: none takes 25 % longer and does not increase the error");
  expect_advice(measured, "shading: flat saves no time and costs 2.0 levels");
  measured.points[1].runs = {1.4, 2.2, 1.5};
  expect_advice(measured, "shadows: map saves no certain time and costs 3.1 levels");
}

/// A point of the parameter "model".
MeasuredPoint model_point(const char* model, const char* value, double seconds, double total, double model_error) {
  MeasuredPoint measured = point("model", value, seconds, 1, 2);
  measured.setting.model = model;
  measured.total_error = total;
  measured.model_error = model_error;
  return measured;
}

Measurement measured_models() {
  Measurement measured =
      measurement({model_point("whitted", "a", 1, 35, 34.6), model_point("whitted", "b", 2, 36, 34.6),
                   model_point("fitted ambient", "c", 1.5, 14, 13), model_point("path", "d", 5, 10, 0),
                   model_point("path", "e", 4, 12, 0)});
  measured.model_error = {
      .levels = 34.6, .standard_error = 0.5, .bias = -30, .fitted_ambient = {0.107, 0.035, 0.007}, .fitted_levels = 13};
  return measured;
}

TEST(ModelFront, HasTheBestPointsOfOneModel) {
  const Measurement measured = measured_models();
  EXPECT_EQ(tracer::model_front(measured, "whitted"), (Indices{0}));
  EXPECT_EQ(tracer::model_front(measured, "path"), (Indices{4, 3}));
  EXPECT_TRUE(tracer::pareto_front(measured).empty()) << "their claims have different truths";
}

TEST(ModelFront, IsDrawnForEachModel) {
  std::vector<std::string> names;
  for (const tracer::PlotSeries& series : tracer::chart(measured_models()).series) names.push_back(series.name);
  EXPECT_EQ(names, (std::vector<std::string>{"total error: whitted", "total error: fitted ambient", "total error: path",
                                             "error of the references"}));
}

TEST(ModelFront, HasNoUpperLimits) {
  Measurement measured = measured_models();
  measured.points = {model_point("path", "a", 2, 0.6, 0), limited(model_point("path", "b", 1, 0.5, 0), {"total_error"}),
                     limited(model_point("path", "c", 3, 0.5, 0), {"total_error"})};
  EXPECT_EQ(tracer::model_front(measured, "path"), Indices{0});
  const tracer::Plot plot = tracer::chart(measured);
  std::vector<std::pair<double, std::string>> drawn;
  for (const std::size_t series : {0u, 1u})
    for (const tracer::PlotPoint& point : plot.series.at(series).points) drawn.emplace_back(point.y, point.label);
  EXPECT_EQ(drawn,
            (std::vector<std::pair<double, std::string>>{{0.6, "a"}, {0.5, "b (at most)"}, {0.5, "c (at most)"}}));
}

TEST(Advice, StatesTheDistanceOfEachModel) {
  Measurement measured = measured_models();
  const std::string whitted =
      "Whitted's image is 35 levels from the rendering equation and too dark; ambient [0.11, 0.035, 0.007] would make "
      "it 13; ";
  expect_advice(measured, whitted + "below 13 levels only paths help");
  MeasuredPoint radiosity = model_point("radiosity", "f", 1.25, 3, 1.9);
  radiosity.setting.accuracy.approximate.interreflection = tracer::Approximations::Interreflection::radiosity;
  radiosity.setting.accuracy.model = tracer::Accuracy::Model::global;
  measured.points.push_back(radiosity);
  expect_advice(measured, whitted + "radiosity 1.9 for 0.25 s more; below 1.9 levels only paths help");
  measured.points.back() = limited(measured.points.back(), {"model_error"});
  measured.points.back().model_error = 0.5;
  expect_advice(measured, whitted + "radiosity at most 0.50 for 0.25 s more; below 0.50 levels only paths help");
  MeasuredPoint path = model_point("path", "g", 1, 3, 0);
  path.setting.accuracy.model = tracer::Accuracy::Model::global;
  measured.points.push_back(path);
  EXPECT_FALSE(contains_part(measured, "radiosity")) << "paths are faster";
  measured.points.pop_back();
  measured.model_error->fitted_levels = 0.4;
  EXPECT_TRUE(contains_part(measured, "would make it at most 0.50"));
  measured.model_error->levels = 0.4;
  expect_advice(measured,
                "Whitted's image is that of the rendering equation, as far as references with an error of 0.50 "
                "levels show");
  measured.model_error.reset();
  measured.not_measured = "/materials/glass gives back 1.03";
  expect_advice(measured, "the rendering equation is not measured: /materials/glass gives back 1.03");
}

TEST(Advice, StatesTheCausesOfTheMissingLight) {
  Measurement measured = measured_models();
  measured.model_error->by.interreflection = {0.3, 0.2, 0.1};
  const auto starts = [](const std::string& sentence) { return sentence.starts_with("of the light that"); };
  EXPECT_TRUE(std::ranges::none_of(tracer::advice(measured), starts));
  measured.model_error->by.environment = {0.05, 0.05, 0.05};
  expect_advice(measured,
                "of the light that Whitted's model leaves out come 80 % from interreflection of lights, 20 % from "
                "the background");
}

}  // namespace
