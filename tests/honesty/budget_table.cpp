// What adaptive sampling buys, and whether time budgets are kept: each scene with several targets beside the same
// number of samples everywhere, by the time that an equal error takes; and with several budgets, by how far they are
// overrun. Times are of building and tracing, one thread, taken side by side.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <optional>
#include <stdexcept>
#include <string>

#include "tests/honesty/trial.h"
#include "tracer/compile.h"

namespace {

using namespace honesty;

struct Point {
  double seconds = 0, error = 0, claimed = 0;
};

double now_ms() {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// Throws std::runtime_error where there is no picture.
Point measured(const Case& scene, const Standard& standard, const tracer::Accuracy& accuracy) {
  tracer::Scene asked = scene.scene;
  asked.accuracy = accuracy;
  asked.output.layers.clear();
  tracer::RenderControl control;
  const double start = now_ms();
  const auto compiled = tracer::compile(asked, control, scene.assets);
  if (!compiled) throw std::runtime_error(scene.name + ": " + compiled.error().detail);
  const auto rendered =
      tracer::render(**compiled, {.elapsed_ms = [&] { return now_ms() - start; }, .threads = 1}, control);
  const double end = now_ms();
  if (!rendered) throw std::runtime_error(scene.name + ": " + rendered.error().detail);
  const Trial trial = judged(scene, standard, *rendered, 0, accuracy.seed);
  return {(end - start) / 1000, trial.truth, rendered->error.estimate};
}

tracer::Accuracy uniform(std::uint32_t samples) {
  tracer::Accuracy accuracy;
  accuracy.samples = samples;
  return accuracy;
}

tracer::Accuracy adaptive(std::optional<double> target, std::optional<double> budget_ms) {
  tracer::Accuracy accuracy;
  accuracy.adaptive.emplace().target_error = target;
  accuracy.adaptive->time_budget_ms = budget_ms;
  accuracy.cutoff_by_chance = true;
  return accuracy;
}

/// When uniform samples have the error, between two of `ladder` on logarithmic scales; nothing beyond its ends.
std::optional<double> seconds_for(const std::vector<Point>& ladder, double error) {
  for (std::size_t i = 0; i + 1 < ladder.size(); ++i) {
    const Point &coarse = ladder[i], &fine = ladder[i + 1];
    if (!(coarse.error >= error && error > fine.error && fine.error > 0)) continue;
    const double part = std::log(coarse.error / error) / std::log(coarse.error / fine.error);
    return coarse.seconds * std::pow(fine.seconds / coarse.seconds, part);
  }
  return std::nullopt;
}

class Table {
 public:
  void add(const Case& scene, const Standard& standard) {
    std::vector<Point> ladder;
    for (std::uint32_t samples = 1; samples <= 1024; samples *= 2)
      ladder.push_back(measured(scene, standard, uniform(samples)));
    for (const double target : {4.0, 2.0, 1.0, 0.5, 0.25}) {
      const Point point = measured(scene, standard, adaptive(target, {}));
      const auto equal = seconds_for(ladder, point.error);
      std::printf("%-20s target %5.2f  error %7.3f  %8.4f s", scene.name.c_str(), target, point.error, point.seconds);
      if (equal) {
        std::printf("   uniform %8.4f s   %6.2f x", *equal, *equal / point.seconds);
        log_ratios_.push_back(std::log(*equal / point.seconds));
      }
      std::printf("\n");
    }
    for (const double budget : {50.0, 200.0, 1000.0}) {
      const Point point = measured(scene, standard, adaptive({}, budget));
      const double overrun = 1000 * point.seconds - budget;
      std::printf("%-20s budget %5.0f  error %7.3f  claimed %7.3f  overrun %6.1f ms\n", scene.name.c_str(), budget,
                  point.error, point.claimed, overrun);
      allowed_ += overrun <= 0.05 * budget + 5 ? 1 : 0;
      covered_ += point.error <= point.claimed ? 1 : 0;
      overruns_.push_back(overrun / budget);
    }
    std::fflush(stdout);
  }

  void sum_up() {
    double sum = 0;
    for (const double one : log_ratios_) sum += one;
    const auto count = static_cast<double>(log_ratios_.size());
    std::printf("equal error: uniform takes %.2f times as long (geometric mean of %.0f pairs)\n",
                std::exp(sum / std::max(1.0, count)), count);
    std::sort(overruns_.begin(), overruns_.end());
    const std::size_t budgets = overruns_.size();
    if (budgets == 0) return;
    std::printf(
        "budgets: %zu of %zu within 5 %% + 5 ms; overrun %.1f %% in the median, %.1f %% at p99, %.1f %% at most\n",
        allowed_, budgets, 100 * overruns_[budgets / 2], 100 * overruns_[(budgets - 1) * 99 / 100],
        100 * overruns_.back());
    std::printf("budgets: the truth is within what is claimed in %zu of %zu\n", covered_, budgets);
  }

 private:
  std::vector<double> log_ratios_, overruns_;
  std::size_t allowed_ = 0, covered_ = 0;
};

}  // namespace

int main(int count, char** values) try {
  if (count > 1 && std::strcmp(values[1], "--help") == 0) {
    std::puts(
        "budget_table REFERENCES [SCALE [SCENE ...]]: times of adaptive and uniform samples, and time budgets.\n"
        "REFERENCES is a folder to keep references in; SCALE enlarges the pictures; scenes as honesty_table has them.");
    return 0;
  }
  if (count < 2) throw std::runtime_error("give a folder for references");
  const std::uint32_t scale = count > 2 ? static_cast<std::uint32_t>(std::stoul(values[2])) : 1;
  const std::vector<std::string> wanted(values + std::min(count, 3), values + count);
  Table table;
  for (Case scene : corpus()) {
    if (!wanted.empty() && std::find(wanted.begin(), wanted.end(), scene.name) == wanted.end()) continue;
    if (scale > 1 && scene.scene.image.crop) continue;
    scene.scene.image.width *= scale;
    scene.scene.image.height *= scale;
    table.add(scene, {reference_of(scene, {}, values[1]), strata_of(scene, 0)});
  }
  table.sum_up();
  return 0;
} catch (const std::exception& problem) {
  std::fprintf(stderr, "budget_table: %s\n", problem.what());
  return 2;
}
