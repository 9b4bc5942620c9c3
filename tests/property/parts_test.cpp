// Parts of a render that are traced elsewhere: the image, its layers, its error estimate and all statistics are those
// of one process, traced by any process in any order.
#include "tracer/parts.h"

#include <gtest/gtest.h>

#include <cstring>
#include <map>
#include <mutex>
#include <random>
#include <string>

#include "tests/support/scenes.h"

namespace tracer {
namespace {

/// Hands parts out at random: some are traced by the render, others from their bytes alone with a scene that was
/// compiled again. Their results come late and in any order, some twice, some never, and some are not of the part.
class RandomExchange final : public PartExchange {
 public:
  RandomExchange(const Scene& scene, unsigned seed) : elsewhere_(scenes::compiled(scene)), random_(seed) {}

  bool divides(std::uint64_t samples) override { return samples > 0; }
  void begin(std::span<const Part> parts) override {
    const std::lock_guard lock(mutex_);
    parts_ = parts;
    ++rounds;
    here_.clear(), away_.clear(), lost_.clear(), damaged_.clear();
    for (std::size_t i = 0; i < parts.size(); ++i) {
      const int fate = static_cast<int>(random_() % 6);
      if (fate <= 1 || fate == 5) here_.push_back(i);
      if (fate >= 2 && fate <= 3) away_.push_back(i);
      if (fate == 3 || fate == 5) away_.push_back(i);  // a repeated result, or one that comes too late
      if (fate == 4) (random_() % 2 == 0 ? lost_ : damaged_).push_back(i);
    }
    std::shuffle(here_.begin(), here_.end(), random_);
  }
  std::optional<std::size_t> take() override {
    const std::lock_guard lock(mutex_);
    if (here_.empty()) return std::nullopt;
    const std::size_t part = here_.back();
    here_.pop_back();
    return part;
  }
  void put(std::size_t part, std::string_view result) override {
    const std::lock_guard lock(mutex_);
    ++traced_here;
    result_bytes += result.size();
    result_samples += parts_[part].samples;
  }
  std::vector<PartResult> wait() override {
    std::vector<PartResult> results;
    for (const std::size_t part : away_) results.push_back({part, traced_elsewhere(part)});
    for (const std::size_t part : damaged_) results.push_back({part, damaged(traced_elsewhere(part))});
    std::shuffle(results.begin(), results.end(), random_);
    here_ = std::move(lost_);
    lost_.clear(), away_.clear(), damaged_.clear();
    return results;
  }

  int rounds = 0, traced_here = 0, traced_away = 0;
  std::uint64_t result_bytes = 0, result_samples = 0;

 private:
  std::string traced_elsewhere(std::size_t part) {
    ++traced_away;
    RenderControl control;
    return *trace_part(*elsewhere_, std::string(parts_[part].bytes), {.threads = 2}, control);
  }
  static constexpr std::size_t counters = 12 * sizeof(std::uint64_t);
  std::string damaged(std::string result) {
    switch (random_() % 4) {
      case 0:
        return result.substr(0, result.size() / 2);
      case 1:
        return result + '\0';
      case 2:
        return result.substr(0, counters) + std::string(result.size() - counters, '\xff');  // no finite number
      default:
        result[5 * sizeof(std::uint64_t)] ^= 1;
        return result;  // another number of samples
    }
  }

  const std::shared_ptr<const CompiledScene> elsewhere_;
  std::mutex mutex_;
  std::mt19937 random_;
  std::span<const Part> parts_;
  std::vector<std::size_t> here_, away_, lost_, damaged_;
};

template <class T>
bool same_bytes(const std::vector<T>& one, const std::vector<T>& other) {
  return one.size() == other.size() &&
         (one.empty() || std::memcmp(one.data(), other.data(), one.size() * sizeof(T)) == 0);
}

void expect_equal(const Rendered& one, const Rendered& other) {
  EXPECT_TRUE(same_bytes(one.image.rgb, other.image.rgb));
  EXPECT_TRUE(same_bytes(one.image.alpha, other.image.alpha));
  const Layers &layers = one.image.layers, &others = other.image.layers;
  EXPECT_TRUE(same_bytes(layers.depth, others.depth));
  EXPECT_TRUE(same_bytes(layers.normal, others.normal));
  EXPECT_TRUE(same_bytes(layers.albedo, others.albedo));
  EXPECT_TRUE(same_bytes(layers.object_id, others.object_id));
  EXPECT_TRUE(same_bytes(layers.samples, others.samples));
  EXPECT_TRUE(same_bytes(layers.error, others.error));
  EXPECT_EQ(one.statistics, other.statistics);
  const ErrorEstimate &a = one.error, &b = other.error;
  EXPECT_EQ(std::tie(a.estimate, a.proven, a.worst_tile, a.sampling, a.depth, a.cutoff, a.approximation,
                     a.approximation_min, a.tone),
            std::tie(b.estimate, b.proven, b.worst_tile, b.sampling, b.depth, b.cutoff, b.approximation,
                     b.approximation_min, b.tone));
  EXPECT_EQ(std::tie(a.target_met, a.bounded, a.looks, a.limit), std::tie(b.target_met, b.bounded, b.looks, b.limit));
}

void expect_equal_in_parts(const Scene& scene) {
  const Rendered whole = scenes::render(scene);
  for (const unsigned seed : {1u, 2u}) {
    SCOPED_TRACE(seed);
    RandomExchange exchange(scene, seed);
    RenderControl control;
    const auto divided = render(*scenes::compiled(scene), {.threads = 2, .exchange = &exchange}, control);
    ASSERT_TRUE(divided);
    EXPECT_GT(exchange.traced_here, 0);
    EXPECT_GT(exchange.traced_away, 0);
    expect_equal(whole, *divided);
  }
}

constexpr std::uint32_t image_side = 100;

Scene uniform(std::uint64_t seed, std::uint32_t samples) {
  Scene scene = scenes::random(seed, image_side);
  scene.accuracy.samples = samples;
  return scene;
}

Scene adaptive(std::uint64_t seed, double target_error) {
  Scene scene = scenes::random(seed, image_side);
  scene.accuracy.target_error = target_error;
  scene.accuracy.adaptive.emplace().target_error = target_error;
  scene.accuracy.adaptive->samples_max = 256;
  scenes::end_by_chance(scene);
  return scene;
}

/// Scenes with all that a part has to carry.
std::map<std::string, Scene> scenes_by_feature() {
  std::map<std::string, Scene> all{{"3 samples", uniform(3, 3)},
                                   {"16 samples", uniform(16, 16)},
                                   {"1 sample of many pixels", uniform(5, 1)},
                                   {"target error", adaptive(3, 0.6)},
                                   {"target error of another scene", adaptive(4, 0.6)},
                                   {"tile error", adaptive(6, 4)},
                                   {"proof of fixed samples", uniform(15, 9)},
                                   {"proof of a target error", adaptive(16, 1)},
                                   {"layers of fixed samples", uniform(7, 9)},
                                   {"layers of a target error", adaptive(8, 1)},
                                   {"crop of fixed samples", uniform(9, 16)},
                                   {"crop of a target error", adaptive(9, 0.6)},
                                   {"approximation", adaptive(10, 1)},
                                   {"scaled image", adaptive(11, 1)},
                                   {"global light of fixed samples", uniform(14, 16)},
                                   {"global light of a target error", adaptive(14, 2)}};
  all["1 sample of many pixels"].image = {.width = 600, .height = 300};
  all["tile error"].accuracy.adaptive->tile_error = 5;
  all["approximation"].accuracy.approximate.shadows = Approximations::Shadows::none;
  all["scaled image"].output.overflow = Output::Overflow::scale;
  for (auto& [name, scene] : all) {
    if (name.starts_with("proof")) scene.accuracy.proof = true;
    if (name.starts_with("crop")) scene.image = {.width = 300, .height = 280, .crop = PixelWindow{90, 101, 203, 180}};
    if (name.starts_with("global light")) scenes::light_globally(scene);
    if (!name.starts_with("layers")) continue;
    scene.output.layers = {Layer::depth, Layer::normal, Layer::albedo, Layer::object_id, Layer::samples, Layer::error};
    scene.output.alpha = true;
  }
  return all;
}

TEST(TracePart, RendersAsOneProcess) {
  for (const auto& [name, scene] : scenes_by_feature()) {
    SCOPED_TRACE(name);
    expect_equal_in_parts(scene);
  }
}

TEST(TracePart, NeedsFewBytesForEachPixel) {
  Scene scene = uniform(12, 16);
  RandomExchange exchange(scene, 1);
  RenderControl control;
  ASSERT_TRUE(render(*scenes::compiled(scene), {.threads = 1, .exchange = &exchange}, control));
  const double pixels = static_cast<double>(exchange.result_samples) / 16;
  EXPECT_LE(static_cast<double>(exchange.result_bytes) / pixels, 40);
}

TEST(TracePart, LeavesRendersWithATimeBudgetWhole) {
  Scene scene = adaptive(13, 0.5);
  scene.accuracy.adaptive->time_budget_ms = 1e6;
  RandomExchange exchange(scene, 1);
  RenderControl control;
  ASSERT_TRUE(render(*scenes::compiled(scene), {.elapsed_ms = [] { return 1.0; }, .exchange = &exchange}, control));
  EXPECT_EQ(exchange.rounds, 0);
}

TEST(TracePart, EndsWhenTheRenderIsCancelled) {
  struct Cancelling final : PartExchange {
    explicit Cancelling(RenderControl& of_render) : control(of_render) {}
    bool divides(std::uint64_t) override { return true; }
    void begin(std::span<const Part>) override {}
    std::optional<std::size_t> take() override { return std::nullopt; }
    void put(std::size_t, std::string_view) override {}
    std::vector<PartResult> wait() override {
      control.cancel();
      return {};
    }
    RenderControl& control;
  };
  for (const Scene& scene : {uniform(14, 4), adaptive(14, 1)}) {
    RenderControl control;
    Cancelling exchange(control);
    const auto rendered = render(*scenes::compiled(scene), {.exchange = &exchange}, control);
    ASSERT_FALSE(rendered);
    EXPECT_EQ(rendered.error().code, Failure::Code::cancelled);
  }
}

/// Keeps the parts of a render.
struct Recording final : PartExchange {
  bool divides(std::uint64_t) override { return true; }
  void begin(std::span<const Part> of_round) override {
    next = 0;
    count = of_round.size();
    for (const Part& part : of_round) parts.push_back(part.bytes);
  }
  std::optional<std::size_t> take() override { return next < count ? std::optional(next++) : std::nullopt; }
  void put(std::size_t, std::string_view) override {}
  std::vector<PartResult> wait() override { return {}; }
  std::size_t next = 0, count = 0;
  std::vector<std::string> parts;
};

Recording recorded(const Scene& scene) {
  Recording recording;
  RenderControl control;
  EXPECT_TRUE(render(*scenes::compiled(scene), {.threads = 1, .exchange = &recording}, control));
  return recording;
}

TEST(TracePart, DividesEqualScenesEqually) {
  for (const Scene& scene : {uniform(15, 4), adaptive(15, 1)}) EXPECT_EQ(recorded(scene).parts, recorded(scene).parts);
}

TEST(TracePart, RejectsPartsOfOtherScenesAndDamagedOnes) {
  const Scene large = adaptive(16, 1);
  Scene small = large;
  small.image = {.width = 20, .height = 20};
  const auto scene = scenes::compiled(large), other = scenes::compiled(small);
  std::mt19937 random(1);
  const auto trace = [](const CompiledScene& with, const std::string& part) {
    RenderControl control;
    return trace_part(with, part, {.threads = 1}, control);
  };
  const std::vector<std::string> parts = recorded(large).parts;
  ASSERT_GT(parts.size(), 4u);
  int rejected = 0;
  for (const std::string& part : parts) {
    EXPECT_FALSE(trace(*scene, part.substr(0, part.size() - 1)));
    EXPECT_FALSE(trace(*scene, part + '\0'));
    EXPECT_FALSE(trace(*scene, {}));
    if (!trace(*other, part)) ++rejected;
    std::string damaged = part;
    damaged[random() % damaged.size()] ^= static_cast<char>(1 + random() % 255);
    (void)trace(*scene, damaged);  // may be a valid part, but never ends in a crash
  }
  EXPECT_GT(rejected, static_cast<int>(parts.size()) / 2);
}

}  // namespace
}  // namespace tracer
