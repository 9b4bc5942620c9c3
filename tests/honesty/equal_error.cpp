#include "tests/honesty/equal_error.h"

#include <chrono>
#include <cmath>
#include <ctime>
#include <stdexcept>

#include "tracer/compile.h"

namespace honesty {
namespace {

double now_ms() {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

double processor_seconds() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

}  // namespace

Purchase bought(const Case& scene, const Standard* standard, const tracer::Accuracy& accuracy, std::uint32_t threads) {
  tracer::Scene asked = scene.scene;
  asked.accuracy = accuracy;
  asked.output.layers.clear();
  tracer::RenderControl control;
  const auto clock_ms = [&] { return threads == 1 ? 1000 * processor_seconds() : now_ms(); };
  const double start = clock_ms(), used = processor_seconds();
  const auto compiled = tracer::compile(asked, control, scene.assets);
  if (!compiled) throw std::runtime_error(scene.name + ": " + compiled.error().detail);
  const auto rendered =
      tracer::render(**compiled, {.elapsed_ms = [&] { return clock_ms() - start; }, .threads = threads}, control);
  const double seconds = processor_seconds() - used, elapsed_ms = clock_ms() - start;
  if (!rendered) throw std::runtime_error(scene.name + ": " + rendered.error().detail);
  const auto pixels = static_cast<double>(scene.scene.image.window().pixels());
  const tracer::RenderStatistics& statistics = rendered->statistics;
  return {seconds,
          elapsed_ms,
          static_cast<double>(statistics.rays.total()),
          static_cast<double>(statistics.samples) / pixels,
          static_cast<double>(statistics.audit_samples) / pixels,
          standard == nullptr ? 0 : judged(scene, *standard, *rendered, 0, accuracy.seed).truth,
          rendered->error.estimate};
}

tracer::Accuracy adaptive_to(std::optional<double> target, std::optional<double> budget_ms, std::uint64_t seed) {
  tracer::Accuracy accuracy;
  accuracy.adaptive.emplace().target_error = target;
  accuracy.adaptive->time_budget_ms = budget_ms;
  accuracy.cutoff_by_chance = true;
  accuracy.seed = seed;
  return accuracy;
}

Purchase between(const Purchase& coarse, const Purchase& fine, double error) {
  const double part = std::log(coarse.error / error) / std::log(coarse.error / fine.error);
  const auto mean = [&](double Purchase::*cost) { return coarse.*cost * std::pow(fine.*cost / coarse.*cost, part); };
  Purchase purchase;
  purchase.seconds = mean(&Purchase::seconds);
  purchase.rays = mean(&Purchase::rays);
  purchase.samples = mean(&Purchase::samples);
  purchase.error = error;
  return purchase;
}

std::optional<Purchase> UniformCurve::at(double error) {
  for (std::size_t i = 0;; ++i) {
    if (i == points_.size()) {
      const std::uint32_t samples = 1u << i;
      if (samples > samples_max) return std::nullopt;
      tracer::Accuracy accuracy;
      accuracy.samples = samples;
      points_.push_back(bought(scene_, &standard_, accuracy));
    }
    if (points_[i].error > error) continue;
    if (i == 0 || !(points_[i].error > 0)) return std::nullopt;
    return between(points_[i - 1], points_[i], error);
  }
}

}  // namespace honesty
