// The decisions of adaptive sampling, with pilots and samples that no ray has found.
#include "tracer/src/sampling/refinement.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "tests/support/random.h"
#include "tests/support/scenes.h"

namespace tracer {
namespace {

constexpr std::uint32_t width_of_image = 96;

Adaptive until(double target_error) {
  Adaptive target;
  target.target_error = target_error;
  return target;
}

/// An image whose pixels at an upright edge have independent samples of two values, and all others the same value.
/// `seen`: pilots show that the sides of the edge differ.
class TwoSidedImage {
 public:
  explicit TwoSidedImage(const Adaptive& target, bool seen = true)
      : high(seen ? Color{0.56, 0.56, 0.56} : Color{0.7, 0.7, 0.7}), target_(target) {
    for (std::uint32_t y = 0; y < width_of_image; ++y)
      for (std::uint32_t x = 0; x < width_of_image; ++x) {
        const std::uint32_t surface = seen && x > edge ? 3 : 1;
        film_.set_pilot(std::size_t{y} * width_of_image + x, 1, low, {.surface = surface, .normal = {0, 0, 127}});
      }
    refinement_.classify({}, display_, one_by_one);
  }

  /// A round of samples; false if it had none.
  bool round() {
    if (!refinement_.begin_round()) return false;
    bool any = false;
    while (const auto step = refinement_.next_step(1e30)) {
      const TileMerger merger(film_, refinement_.classes(), step->plan, decay_, display_);
      TileBook book;
      for (std::uint64_t i = step->first; i < step->last; ++i) {
        const std::uint64_t tile = tiles_.scattered(i);
        for (const SampleSets& sets : plan_tile(*scene_, film_, tiles_, tile, refinement_.classes(), step->plan)) {
          any = true;
          if (sets.kind != SampleSets::Kind::look) samples_ += sets.samples;
          merger.merge(sets, sums(sets), book);
        }
      }
      refinement_.add(*step, book);
    }
    return any;
  }

  [[nodiscard]] static bool has_edge(std::size_t place) { return place % width_of_image == edge; }
  [[nodiscard]] double true_error() const {
    double sum = 0;
    for (std::size_t place = 0; place < film_.size(); ++place) {
      const double mean = has_edge(place) ? (low.r + high.r) / 2 : low.r;
      sum += 3 * std::pow(display_.level(film_.mean(place).r) - display_.level(mean), 2);
    }
    return sum;
  }

  static constexpr std::uint32_t edge = 40;
  const Color low{0.5, 0.5, 0.5}, high;
  Adaptive target_;
  const SampleDecay decay_{.stratified = false};
  const DisplayTransform display_{{}, 1};
  const InParallel one_by_one = [](std::uint64_t count, const std::function<void(std::uint64_t)>& work) {
    for (std::uint64_t i = 0; i < count; ++i) work(i);
  };
  std::shared_ptr<const CompiledScene> scene_ = [] {
    RenderControl control;
    return *compile(scenes::empty(width_of_image), control);
  }();
  Tiles tiles_{scene_->image.window()};
  Film film_{*scene_, scene_->image.window(), decay_};
  Refinement refinement_{film_, tiles_, target_, decay_};
  std::uint64_t samples_ = 0;

 private:
  SetSums sums(const SampleSets& sets) {
    SetSums sums;
    const std::uint32_t split = sets.kind == SampleSets::Kind::joint ? sets.samples : sets.samples / 2;
    for (std::uint32_t i = 0; i < sets.samples; ++i) {
      const std::size_t set = i < split ? 0 : 1;
      sums.mean[set] += has_edge(sets.place) && random_.chance(0.5) ? high : low;
      ++sums.count[set];
    }
    for (std::size_t set = 0; set < 2; ++set)
      if (sums.count[set] > 0) sums.mean[set] = sums.mean[set] * (1.0 / sums.count[set]);
    return sums;
  }
  oracle::Random random_{17};
};

TEST(Refinement, ReachesTheTargetWithSamplesWhereTheEdgeIs) {
  for (const double target : {0.4, 0.2}) {
    TwoSidedImage image(until(target));
    const double wanted = 3 * target * target * width_of_image * width_of_image;
    while (image.refinement_.error().squared_upper > wanted) ASSERT_TRUE(image.round()) << target;
    EXPECT_LE(image.true_error(), 1.3 * wanted);
    EXPECT_GE(image.true_error(), 0.2 * wanted) << "more samples than needed";
    EXPECT_EQ(image.film_.count(10 * width_of_image + 10), 0u);
    EXPECT_GT(image.film_.count(10 * width_of_image + TwoSidedImage::edge), 1u);
  }
}

/// No pilot has seen the line of bright pixels. Looks find some of them, and the rounds after that their neighbors.
TEST(Refinement, FollowsALineThatOnlyLooksHaveFound) {
  TwoSidedImage image(until(0.4), false);
  const double before = image.true_error(), wanted = 3.0 * 0.4 * 0.4 * width_of_image * width_of_image;
  ASSERT_GT(before, 5 * wanted);
  for (int i = 0; i < 12 && (i == 0 || image.refinement_.error().squared_upper > wanted); ++i) image.round();
  EXPECT_LT(image.true_error(), before / 2);
  EXPECT_LE(image.true_error(), 1.3 * image.refinement_.error().squared_upper);
}

TEST(Refinement, CountsThePixelsThatHadSamplesBefore) {
  TwoSidedImage image(until(0.4));
  constexpr std::uint32_t place = 7 * width_of_image + TwoSidedImage::edge;
  const SampleSets sets{.place = place, .kind = SampleSets::Kind::measured, .samples = 64};
  const TileMerger merger(image.film_, image.refinement_.classes(), {}, image.decay_, image.display_);
  TileBook unused;
  merger.merge(sets, {.mean = {image.low, image.high}, .count = {32, 32}}, unused);
  Refinement refinement(image.film_, image.tiles_, image.target_, image.decay_);
  refinement.classify({}, image.display_, image.one_by_one);
  const double with = refinement.pixel_errors()[place];
  EXPECT_NEAR(with, squared_error(Color{0.53, 0.53, 0.53}, Color{0.03, 0.03, 0.03}, image.display_), 1e-3 * with);
  const double before = refinement.error().squared_upper;
  EXPECT_GT(before, with);
  refinement.scale_errors(4);
  EXPECT_NEAR(refinement.error().squared_upper, 4 * before, 1e-6 * before);
}

TEST(TileMerger, KeepsPilotsAtEdgesAndStatesTheErrorOfTheirMeans) {
  TwoSidedImage image(until(1));
  const auto level = [](double share) { return Color{0.5 + 0.02 * share, 0.5, 0.5}; };
  oracle::Random random(31);
  const std::vector<PixelClass> classes(image.film_.size());
  std::vector<double> true_errors;
  for (const double weight : {0.0, SampleDecay{}.pilot_weight(PixelKind::one_side)}) {
    Film film(*image.scene_, image.scene_->image.window(), {});
    SetsPlan plan;
    plan.pilot_weight.fill(weight);
    TileBook book;
    true_errors.push_back(0);
    for (std::uint32_t place = 0; place < film.size(); ++place) {
      const double edge = random.in(0, 1);
      const auto half = [&] { return level(((random.in(0, 0.5) < edge) + (random.in(0.5, 1) < edge)) / 2.0); };
      film.set_pilot(place, 1, level(edge > 0.5 ? 1 : 0), {});
      TileMerger(film, classes, plan, {}, image.display_)
          .merge({.place = place, .kind = SampleSets::Kind::measured, .samples = 4}, {{half(), half()}, {2, 2}}, book);
      true_errors.back() += std::pow(image.display_.level(film.mean(place).r) - image.display_.level(level(edge).r), 2);
    }
    EXPECT_NEAR(book.classes[0].error / true_errors.back(), 1.05, 0.1) << weight;
  }
  EXPECT_LT(true_errors[1], 0.8 * true_errors[0]);
}

TEST(TileMerger, LeavesNothingOfAnErrorThatManySamplesHaveLowered) {
  TwoSidedImage image(until(1));
  const TileMerger merger(image.film_, image.refinement_.classes(), {}, image.decay_, image.display_);
  TileBook book;
  for (std::uint32_t count = 1; count <= 1u << 20; count *= 4) {
    const double apart = 0.3 / count;
    const SampleSets sets{.kind = SampleSets::Kind::measured, .samples = 2 * count};
    merger.merge(sets, {.mean = {Color{0.4, 0.4, 0.4}, Color{0.4 + apart, 0.4, 0.4}}, .count = {count, count}}, book);
  }
  const ClassStatistics& found = book.classes[image.refinement_.classes()[0]];
  EXPECT_EQ(found.pixels, 1);
  EXPECT_LT(found.error, 1e-3);
  EXPECT_NEAR(found.squares, found.error * found.error, 1e-9);
}

TEST(TileMerger, ShowsThatAVeryBrightSampleRemainsTheErrorOfItsPixel) {
  TwoSidedImage image(until(1));
  const Color hit{1000, 1000, 1000};
  const SampleSets sets{.kind = SampleSets::Kind::measured, .samples = 2};
  const TileMerger merger(image.film_, image.refinement_.classes(), {}, image.decay_, image.display_);
  TileBook book;
  merger.merge(sets, {.mean = {image.low, hit}, .count = {1, 1}}, book);
  for (int more = 0; more < 20; ++more) merger.merge(sets, {.mean = {image.low, image.low}, .count = {1, 1}}, book);
  const double white = image.display_.level(image.film_.mean(0).r), error = white - image.display_.level(image.low.r);
  EXPECT_NEAR(white, 255, 1e-3);
  EXPECT_NEAR(image.film_.error(0), 3 * error * error, 0.01 * error * error);
}

TEST(Refinement, CountsThePilotsOfTilesThatItDidNotReachAndOfSamplesThatWereNotTracedInTime) {
  TwoSidedImage image(until(1));
  ASSERT_TRUE(image.refinement_.begin_round());
  EXPECT_GT(image.refinement_.error().squared_upper, image.true_error());
  while (const auto step = image.refinement_.next_step(1e30)) image.refinement_.add(*step, {});
  EXPECT_GT(image.refinement_.error().squared_upper, image.true_error());
}

TEST(Refinement, TakesNoMoreSamplesThanFixedPartsAreWorth) {
  TwoSidedImage image(until(0.1)), fixed(until(0.1));
  fixed.refinement_.set_fixed(3.0 * width_of_image * width_of_image * 4 * 4);
  EXPECT_FALSE(fixed.refinement_.leaves_room());
  EXPECT_TRUE(image.refinement_.leaves_room());
  image.round();
  fixed.round();
  EXPECT_LT(fixed.samples_, image.samples_ / 4);
}

TEST(Refinement, SamplesTilesUntilTheWorstIsWithinItsTarget) {
  Adaptive target = until(20);
  target.tile_error = 1;
  TwoSidedImage image(target);
  int rounds = 0;
  while (image.refinement_.tile_errors().worst() > 1 && rounds++ < 12) image.round();
  EXPECT_LE(image.refinement_.tile_errors().worst(), 1);
  EXPECT_LE(image.true_error(), 3.0 * width_of_image * width_of_image / 4);
}

}  // namespace
}  // namespace tracer
