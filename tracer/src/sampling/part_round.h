#pragma once
/// Divides a round of samples into parts, which are traced here and elsewhere (tracer/parts.h), and merges their
/// results.

#include <algorithm>
#include <cassert>
#include <cstdint>
#include <mutex>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "tracer/parts.h"
#include "tracer/src/parallel/parallel_for.h"
#include "tracer/src/sampling/part_units.h"

namespace tracer {

/// True if the exchange may divide the rounds of this render.
inline bool may_divide(const CompiledScene& scene, const RenderSettings& settings) {
  const bool has_deadline = scene.accuracy.adaptive && scene.accuracy.adaptive->time_budget_ms;
  return settings.exchange != nullptr && !has_deadline;
}

/// The render that a round belongs to. References must outlive it.
struct PartContext {
  const CompiledScene& scene;
  const RenderSettings& settings;
  RenderControl& control;
  TracerPool<>& pool;
};

/// Traces all units of a part. Its statistics count in the result only.
inline std::variant<UnitOutcome, std::string> trace_units(const MakeTracer& make, const CompiledScene& scene,
                                                          std::string_view part, PartSource source,
                                                          const InParallel& in_parallel, RenderControl& control) {
  PartReader reader(part, source);
  std::uint8_t kind = 0;
  std::uint32_t count = 0;
  if (!reader.get_each(kind, count) || kind > static_cast<std::uint8_t>(PartKind::whole_looks) || count > part.size())
    return UnitOutcome::malformed;
  std::vector<std::string_view> units(count);
  for (std::string_view& unit : units) {
    std::uint32_t size = 0;
    if (!reader.get(size) || !reader.get_bytes(size, unit)) return UnitOutcome::malformed;
  }
  if (!reader.at_end()) return UnitOutcome::malformed;
  const bool exact = static_cast<PartKind>(kind) >= PartKind::exact_looks;
  TracerPool<> pool(make, scene, control, exact ? Approximations{} : scene.accuracy.approximate);
  std::vector<std::string> results(count);
  std::vector<UnitOutcome> outcomes(count, UnitOutcome::cancelled);
  std::vector<RenderStatistics> statistics(count);
  in_parallel(count, [&](std::uint64_t i) {
    if (control.cancelled()) return;
    const auto tracer = pool.lease();
    const RenderStatistics before = (*tracer).statistics();
    PartReader unit(units[i], source);
    PartWriter writer;
    outcomes[i] = trace_unit(static_cast<PartKind>(kind), scene, control, unit, *tracer, writer);
    if (outcomes[i] == UnitOutcome::traced && !unit.at_end()) outcomes[i] = UnitOutcome::malformed;
    results[i] = writer.take();
    statistics[i] = difference((*tracer).statistics(), before);
  });
  RenderStatistics total;
  for (std::size_t i = 0; i < units.size(); ++i) {
    if (outcomes[i] != UnitOutcome::traced) return outcomes[i];
    add(total, statistics[i]);
  }
  PartWriter result;
  each_counter(total, [&](std::uint64_t counter) { result.put(counter); });
  for (const std::string& unit : results) result.append(unit);
  return result.take();
}

class DividedRound {
 public:
  DividedRound(PartRound& round, const PartContext& context) : round_(round), context_(context) {}

  /// False if the exchange does not divide the round. Otherwise all parts are merged, or the render is cancelled.
  bool trace() {
    std::uint64_t samples = 0;
    for (std::uint64_t unit = 0; unit < round_.count(); ++unit) samples += round_.samples(unit);
    PartExchange& exchange = *context_.settings.exchange;
    if (samples == 0 || !exchange.divides(samples)) return false;
    divide(samples);
    exchange.begin(parts_);
    const std::uint32_t threads = context_.settings.threads;
    while (left_ > 0 && !context_.control.cancelled()) {
      for_each_tile(concurrency(threads), threads, [&](std::uint64_t) {
        while (!context_.control.cancelled()) {
          const std::optional<std::size_t> part = exchange.take();
          if (!part) return;
          trace_here(*part);
        }
      });
      if (left_ == 0 || context_.control.cancelled()) break;
      for (const PartResult& result : exchange.wait())
        if (result.part < parts_.size() && !store(result.part, result.bytes, PartSource::untrusted))
          trace_here(result.part);
    }
    return true;
  }

 private:
  /// Parts with equal work: more than there are workers, each of tens of milliseconds or more where there is so much
  /// work.
  static constexpr std::uint64_t parts_wanted = 128, part_samples_min = 4096, part_samples_max = 1u << 17;

  void divide(std::uint64_t samples) {
    const std::uint64_t each = std::clamp(samples / parts_wanted, part_samples_min, part_samples_max);
    for (std::uint64_t first = 0, last = 0; first < round_.count(); first = last) {
      Part& part = parts_.emplace_back();
      while (last < round_.count() && part.samples < each) part.samples += round_.samples(last++);
      PartWriter writer;
      writer.put_each(static_cast<std::uint8_t>(round_.kind()), static_cast<std::uint32_t>(last - first));
      for (std::uint64_t unit = first; unit < last; ++unit) {
        PartWriter description;
        round_.describe(unit, description);
        const std::string bytes = description.take();
        writer.put(static_cast<std::uint32_t>(bytes.size()));
        writer.append(bytes);
      }
      part.bytes = writer.take();
      first_units_.push_back(first);
    }
    first_units_.push_back(round_.count());
    done_.resize(parts_.size());
    left_ = parts_.size();
  }

  void trace_here(std::size_t part) {
    const InParallel in_order = [](std::uint64_t count, const std::function<void(std::uint64_t)>& work) {
      for (std::uint64_t i = 0; i < count; ++i) work(i);
    };
    const auto traced = trace_units(context_.pool.make(), context_.scene, parts_[part].bytes, PartSource::own, in_order,
                                    context_.control);
    const auto* result = std::get_if<std::string>(&traced);
    if (result == nullptr) return;  // cancelled
    [[maybe_unused]] const bool stored = store(part, *result, PartSource::own);
    assert(stored);
    context_.settings.exchange->put(part, *result);
  }

  /// Merges a result; false if it does not belong to the part. Results of a part beyond the first are ignored.
  bool store(std::size_t part, std::string_view bytes, PartSource source) {
    const std::lock_guard lock(mutex_);
    if (done_[part]) return true;
    PartReader reader(bytes, source);
    RenderStatistics statistics;
    bool valid = true;
    each_counter(statistics, [&](std::uint64_t& counter) { valid = valid && reader.get(counter); });
    if (!valid || statistics.samples != parts_[part].samples) return false;
    for (std::uint64_t unit = first_units_[part]; unit < first_units_[part + 1]; ++unit)
      if (!round_.store(unit, reader)) return false;
    if (!reader.at_end()) return false;
    context_.pool.add_statistics(statistics);
    if (round_.kind() == PartKind::uniform)
      for (std::uint64_t unit = first_units_[part]; unit < first_units_[part + 1]; ++unit)
        context_.control.finish_tile();
    done_[part] = true;
    --left_;
    return true;
  }

  PartRound& round_;
  const PartContext& context_;
  std::vector<Part> parts_;
  std::vector<std::uint64_t> first_units_;  ///< by part; then the number of units
  std::mutex mutex_;
  std::vector<bool> done_;  ///< by part
  std::size_t left_ = 0;
};

/// Traces a round as parts if the exchange divides it; else returns false.
inline bool trace_in_parts(PartRound& round, const PartContext& context) {
  return may_divide(context.scene, context.settings) && DividedRound(round, context).trace();
}

}  // namespace tracer
