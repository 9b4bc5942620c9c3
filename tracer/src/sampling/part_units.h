#pragma once
/// Rounds of samples as units that can be traced elsewhere: tiles with the same samples in every pixel, pilots, samples
/// of adaptive rounds, and looks. Each kind has a description of a unit, its tracing from that description, and the
/// merging of its result.

#include <algorithm>
#include <cstdint>
#include <mutex>
#include <optional>
#include <span>
#include <vector>

#include "tracer/src/integrators/tracer.h"
#include "tracer/src/sampling/deadline.h"
#include "tracer/src/sampling/film.h"
#include "tracer/src/sampling/looks.h"
#include "tracer/src/sampling/part_bytes.h"
#include "tracer/src/sampling/pilot.h"
#include "tracer/src/sampling/sample_sets.h"
#include "tracer/src/sampling/tiles.h"
#include "tracer/src/sampling/uniform_tracer.h"

namespace tracer {

/// Looks are as the samples of the image, exact ones without approximations, whole ones also without limits of rays.
enum class PartKind : std::uint8_t { uniform, pilots, round, looks, exact_looks, whole_looks };

/// A round of samples in units that touch different pixels.
class PartRound {
 public:
  virtual ~PartRound() = default;
  [[nodiscard]] virtual PartKind kind() const = 0;
  [[nodiscard]] virtual std::uint64_t count() const = 0;  ///< number of units
  [[nodiscard]] virtual std::uint64_t samples(std::uint64_t unit) const = 0;
  /// Writes all that the samples of the unit depend on beside the scene.
  virtual void describe(std::uint64_t unit, PartWriter& writer) const = 0;
  /// Merges the result of a unit. False if it is not one; the unit's pixels are then undefined until the next call.
  virtual bool store(std::uint64_t unit, PartReader& result) = 0;
};

enum class UnitOutcome { traced, cancelled, malformed };

// ---- tiles with the same number of samples in every pixel

class UniformRound final : public PartRound {
 public:
  UniformRound(UniformFilm& film, PreviewTiles& preview, std::uint32_t samples)
      : film_(film), preview_(preview), samples_(samples) {}
  [[nodiscard]] PartKind kind() const override { return PartKind::uniform; }
  [[nodiscard]] std::uint64_t count() const override { return film_.tiles.count(); }
  [[nodiscard]] std::uint64_t samples(std::uint64_t unit) const override {
    return std::uint64_t{samples_} * film_.tiles.window(unit).pixels();
  }
  void describe(std::uint64_t unit, PartWriter& writer) const override { writer.put(unit); }
  bool store(std::uint64_t unit, PartReader& result) override {
    PreviewTiles::Tile tile(preview_, unit);
    const std::lock_guard lock(tile);
    return film_.read_tile(unit, result);
  }

 private:
  UniformFilm& film_;
  PreviewTiles& preview_;
  std::uint32_t samples_;
};

inline UnitOutcome trace_uniform_unit(const CompiledScene& scene, PartReader& unit, Tracer& tracer,
                                      PartWriter& result) {
  std::uint64_t tile = 0;
  const Tiles tiles(scene.image.window());
  if (!unit.get(tile) || tile >= tiles.count()) return UnitOutcome::malformed;
  UniformFilm film(scene, tiles.window(tile));
  if (!UniformTracer(scene, film).trace_tile(0, tracer)) return UnitOutcome::cancelled;
  film.write_tile(0, result);
  return UnitOutcome::traced;
}

// ---- adaptive sampling

/// The only tile of a window, as a part of a film that is elsewhere.
struct TileFilm {
  TileFilm(const CompiledScene& scene, const PixelWindow& window)
      : tiles(window), film(scene, window, {}), preview(nullptr, tiles, window, {}) {}

  const RenderSettings settings;
  const Deadline never{settings, {}, 1};
  Tiles tiles;
  Film film;
  PreviewTiles preview;
};

inline void write_layers(const LayerAccumulator* layers, PartWriter& writer) {
  if (layers == nullptr) return;
  LayerAccumulator::with_fields(*layers, [&](const auto&... fields) { writer.put_each(fields...); });
}
[[nodiscard]] inline bool read_layers(LayerAccumulator* layers, PartReader& reader) {
  return layers == nullptr ||
         LayerAccumulator::with_fields(*layers, [&](auto&... fields) { return reader.get_each(fields...); });
}

/// The pilot of every pixel.
class PilotRound final : public PartRound {
 public:
  PilotRound(Film& film, const Tiles& tiles, Pilots& pilots, PreviewTiles& preview)
      : film_(film), tiles_(tiles), pilots_(pilots), preview_(preview) {}
  [[nodiscard]] PartKind kind() const override { return PartKind::pilots; }
  [[nodiscard]] std::uint64_t count() const override { return tiles_.count(); }
  [[nodiscard]] std::uint64_t samples(std::uint64_t unit) const override { return tiles_.window(unit).pixels(); }
  void describe(std::uint64_t unit, PartWriter& writer) const override { writer.put(unit); }
  bool store(std::uint64_t unit, PartReader& result) override {
    PreviewTiles::Tile tile(preview_, unit);
    const std::lock_guard lock(tile);
    for (const Pixel& pixel : tiles_.pixels(unit)) {
      const std::size_t place = tiles_.place(pixel);
      Color radiance;
      SampleSignature signature;
      const bool read = signature.with_fields([&](auto&... fields) { return result.get_each(fields...); });
      if (!read || !result.get(radiance) || !read_layers(film_.layers(place), result)) return false;
      if (!film_.omitted().empty() && !result.get(film_.omitted()[place])) return false;
      film_.set_pilot(place, 1, radiance, signature);
    }
    pilots_.set_traced(unit);
    return true;
  }

 private:
  Film& film_;
  const Tiles& tiles_;
  Pilots& pilots_;
  PreviewTiles& preview_;
};

inline UnitOutcome trace_pilot_unit(const CompiledScene& scene, PartReader& unit, Tracer& tracer, PartWriter& result) {
  std::uint64_t tile = 0;
  const Tiles tiles(scene.image.window());
  if (!unit.get(tile) || tile >= tiles.count()) return UnitOutcome::malformed;
  TileFilm own(scene, tiles.window(tile));
  Pilots pilots(scene, own.film, own.tiles, own.never, own.preview);
  pilots.trace(0, 1, tracer);
  if (!pilots.complete()) return UnitOutcome::cancelled;
  for (const Pixel& pixel : own.tiles.pixels(0)) {
    const std::size_t place = own.tiles.place(pixel);
    SampleSignature(own.film.signatures()[place]).with_fields([&](auto&... fields) { result.put_each(fields...); });
    result.put(own.film.mean(place));
    write_layers(own.film.layers(place), result);
    if (!own.film.omitted().empty()) result.put(own.film.omitted()[place]);
  }
  return UnitOutcome::traced;
}

/// Sets of samples, by tile.
class SetsRound final : public PartRound {
 public:
  struct Unit {
    std::uint64_t tile = 0;
    std::vector<SampleSets> sets;
  };
  SetsRound(const CompiledScene& scene, std::span<const Unit> units)
      : scene_(scene), units_(units), sums_(units.size()) {}
  [[nodiscard]] PartKind kind() const override { return PartKind::round; }
  [[nodiscard]] std::uint64_t count() const override { return units_.size(); }
  [[nodiscard]] std::uint64_t samples(std::uint64_t unit) const override {
    std::uint64_t samples = 0;
    for (const SampleSets& sets : units_[unit].sets) samples += sets.samples;
    return samples;
  }
  void describe(std::uint64_t unit, PartWriter& writer) const override {
    for (const SampleSets& sets : units_[unit].sets)
      writer.put_each(sets.place, static_cast<std::uint8_t>(sets.kind), sets.samples, sets.round);
  }
  bool store(std::uint64_t unit, PartReader& result) override {
    sums_[unit].assign(units_[unit].sets.size(), {});
    for (std::size_t i = 0; i < sums_[unit].size(); ++i)
      if (!read(units_[unit].sets[i], sums_[unit][i], result)) return false;
    return true;
  }
  /// The sums of a unit's sets. A unit may be stored again, so that these are merged when the round is over.
  [[nodiscard]] std::span<const SetSums> sums(std::uint64_t unit) const { return sums_[unit]; }

 private:
  [[nodiscard]] bool read(const SampleSets& sets, SetSums& sums, PartReader& result) const {
    if (!result.get_each(sums.count[0], sums.count[1], sums.mean[0], sums.mean[1])) return false;
    const std::uint32_t most = sets.kind == SampleSets::Kind::joint ? sets.samples : sets.samples / 2;
    if (sums.count[0] > most || sums.count[1] > most) return false;
    return read_layers(scene_.needs.layers ? &sums.layers : nullptr, result);
  }

  const CompiledScene& scene_;
  std::span<const Unit> units_;
  std::vector<std::vector<SetSums>> sums_;  ///< by unit
};

inline UnitOutcome trace_sets_unit(const CompiledScene& scene, const RenderControl& control, PartReader& unit,
                                   Tracer& tracer, PartWriter& result) {
  constexpr std::uint32_t samples_max = 1u << 20;
  const PixelWindow window = scene.image.window();
  std::vector<SampleSets> sets;
  while (!unit.at_end()) {
    SampleSets& one = sets.emplace_back();
    std::uint8_t kind = 0;
    if (!unit.get_each(one.place, kind, one.samples, one.round) || one.place >= window.pixels() || kind > 2 ||
        one.samples < 2 || one.samples > samples_max || one.samples % 2 != 0)
      return UnitOutcome::malformed;
    one.kind = static_cast<SampleSets::Kind>(kind);
  }
  const auto write = [&](std::size_t, SetSums sums) {
    result.put_each(sums.count[0], sums.count[1], sums.mean[0], sums.mean[1]);
    write_layers(scene.needs.layers ? &sums.layers : nullptr, result);
  };
  const bool traced = trace_sets(
      scene, Tiles(window), sets, tracer, [&](std::size_t) { return control.cancelled(); }, write);
  return traced ? UnitOutcome::traced : UnitOutcome::cancelled;
}

// ---- looks

class LookRound final : public PartRound {
 public:
  /// `half`: samples in each half, at most look_half_max.
  LookRound(PartKind kind, std::uint32_t half, const Tiles& tiles, std::span<const Look> looks)
      : kind_(kind), half_(half), halves_(looks.size()) {
    constexpr std::size_t unit_samples_max = 1u << 14;
    const std::size_t unit_looks_max = std::max<std::size_t>(1, unit_samples_max / (2 * half));
    std::vector<std::vector<std::size_t>> of_tile(tiles.count());
    for (std::size_t i = 0; i < looks.size(); ++i) of_tile[tiles.index(tiles.pixel(looks[i].place))].push_back(i);
    for (const auto& indices : of_tile) {
      std::size_t in_unit = 0;
      for (const std::size_t i : indices) {
        if (in_unit++ % unit_looks_max == 0) ends_.push_back(order_.size());
        order_.push_back(i);
        looks_.push_back(looks[i]);
        ends_.back() = order_.size();
      }
    }
  }
  [[nodiscard]] PartKind kind() const override { return kind_; }
  [[nodiscard]] std::uint64_t count() const override { return ends_.size(); }
  [[nodiscard]] std::uint64_t samples(std::uint64_t unit) const override {
    return std::uint64_t{2} * half_ * (ends_[unit] - first(unit));
  }
  void describe(std::uint64_t unit, PartWriter& writer) const override {
    writer.put(half_);
    for (const Look& look : looks(unit)) writer.put_each(look.place, look.index);
  }
  bool store(std::uint64_t unit, PartReader& result) override {
    return std::ranges::all_of(halves(unit), [&](std::optional<Halves>& entry) {
      std::uint8_t measured = 0;
      if (!result.get(measured) || measured > 1) return false;
      entry.reset();
      return measured == 0 || result.get_each(entry.emplace()[0], (*entry)[1]);
    });
  }

  [[nodiscard]] std::span<const Look> looks(std::uint64_t unit) const {
    return std::span(looks_).subspan(first(unit), ends_[unit] - first(unit));
  }
  /// Parallel to looks(unit).
  [[nodiscard]] std::span<std::optional<Halves>> halves(std::uint64_t unit) {
    return std::span(halves_).subspan(first(unit), ends_[unit] - first(unit));
  }
  /// Calls use(index of the look, its halves) for the looks of the unit that have some.
  template <class Use>
  void each(std::uint64_t unit, const Use& use) const {
    for (std::size_t i = first(unit); i < ends_[unit]; ++i)
      if (halves_[i]) use(order_[i], *halves_[i]);
  }

 private:
  [[nodiscard]] std::size_t first(std::uint64_t unit) const { return unit == 0 ? 0 : ends_[unit - 1]; }

  PartKind kind_;
  std::uint32_t half_;
  std::vector<Look> looks_;  ///< by tile
  std::vector<std::optional<Halves>> halves_;
  std::vector<std::size_t> order_;  ///< index of each look before
  std::vector<std::size_t> ends_;   ///< by unit
};

/// Traces looks at pixels of a window and writes the means of their halves, one entry for each look; nothing where a
/// half has no finite sample. Returns false if cancelled.
inline bool trace_looks(const CompiledScene& scene, PartKind kind, const Tiles& tiles, std::span<const Look> looks,
                        std::uint32_t half_size, Tracer& tracer, std::span<std::optional<Halves>> means) {
  constexpr std::uint64_t first_stream = std::uint64_t{1} << 40;  // beyond the streams of the image
  Batch& batch = tracer.batch();
  batch.clear();
  batch.light_points = 2;
  if (kind == PartKind::whole_looks) batch.lifted = {true, true, 1e-3, 512};  // so that few exceed their bounds
  const double share = look_share(scene, kind != PartKind::looks);
  for (const Look& look : looks) {
    const Pixel pixel = tiles.pixel(look.place);
    for (std::uint32_t half = 0; half < 2; ++half)
      for (std::uint32_t index = 0; index < half_size; ++index) {
        Sample sample = fresh_sample(scene, pixel.x, pixel.y, index, first_stream + 2 * look.index + half);
        sample.share = share;
        push(batch, scene, sample);
      }
  }
  if (!tracer.trace()) return false;
  average_halves(tracer.radiance(), half_size, means);
  return true;
}

inline UnitOutcome trace_look_unit(PartKind kind, const CompiledScene& scene, PartReader& unit, Tracer& tracer,
                                   PartWriter& result) {
  const Tiles tiles(scene.image.window());
  std::uint32_t half = 0;
  if (!unit.get(half) || half == 0 || half > look_half_max) return UnitOutcome::malformed;
  std::vector<Look> looks;
  while (!unit.at_end()) {
    Look& look = looks.emplace_back();
    if (!unit.get_each(look.place, look.index) || look.place >= scene.image.window().pixels())
      return UnitOutcome::malformed;
  }
  std::vector<std::optional<Halves>> halves(looks.size());
  if (!trace_looks(scene, kind, tiles, looks, half, tracer, halves)) return UnitOutcome::cancelled;
  for (const std::optional<Halves>& entry : halves) {
    result.put(static_cast<std::uint8_t>(entry ? 1 : 0));
    if (entry) result.put_each((*entry)[0], (*entry)[1]);
  }
  return UnitOutcome::traced;
}

inline UnitOutcome trace_unit(PartKind kind, const CompiledScene& scene, const RenderControl& control, PartReader& unit,
                              Tracer& tracer, PartWriter& result) {
  switch (kind) {
    case PartKind::uniform:
      return trace_uniform_unit(scene, unit, tracer, result);
    case PartKind::pilots:
      return trace_pilot_unit(scene, unit, tracer, result);
    case PartKind::round:
      return trace_sets_unit(scene, control, unit, tracer, result);
    case PartKind::looks:
    case PartKind::exact_looks:
    case PartKind::whole_looks:
      return trace_look_unit(kind, scene, unit, tracer, result);
  }
  return UnitOutcome::malformed;
}

}  // namespace tracer
