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

#include "tracer/src/integrators/tracer_concept.h"
#include "tracer/src/sampling/deadline.h"
#include "tracer/src/sampling/film.h"
#include "tracer/src/sampling/looks.h"
#include "tracer/src/sampling/part_bytes.h"
#include "tracer/src/sampling/pilot.h"
#include "tracer/src/sampling/round_tracer.h"
#include "tracer/src/sampling/tiles.h"
#include "tracer/src/sampling/uniform_tracer.h"

namespace tracer {

enum class PartKind : std::uint8_t { uniform, pilots, round, looks, exact_looks };

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

template <Tracer T>
UnitOutcome trace_uniform_unit(const CompiledScene& scene, PartReader& unit, T& tracer, PartWriter& result) {
  std::uint64_t tile = 0;
  const Tiles tiles(scene.image.window());
  if (!unit.get(tile) || tile >= tiles.count()) return UnitOutcome::malformed;
  UniformFilm film(scene, tiles.window(tile));
  if (!UniformTracer<T>(scene, film).trace_tile(0, tracer)) return UnitOutcome::cancelled;
  film.write_tile(0, result);
  return UnitOutcome::traced;
}

// ---- adaptive sampling

/// The only tile of a window, as a part of a film that is elsewhere.
struct TileFilm {
  TileFilm(const CompiledScene& scene, const PixelWindow& window)
      : tiles(window), film(scene, window, in_order), preview(nullptr, tiles, window, {}) {}

  const InParallel in_order = [](std::uint64_t count, const std::function<void(std::uint64_t)>& work) {
    for (std::uint64_t i = 0; i < count; ++i) work(i);
  };
  const RenderSettings settings;
  const Deadline never{settings, {}, 1};
  Tiles tiles;
  Film film;
  PreviewTiles preview;
};

/// Calls use(field...) with the omitted radiance and the layers, where the scene has them.
template <class Use>
bool with_sums(const Film::PixelSums& sums, const Use& use) {
  return (sums.omitted == nullptr || use(*sums.omitted)) &&
         (sums.layers == nullptr || LayerAccumulator::with_fields(*sums.layers, use));
}
inline void write_sums(const Film::PixelSums& sums, PartWriter& writer) {
  with_sums(sums, [&](const auto&... fields) {
    writer.put_each(fields...);
    return true;
  });
}
inline bool read_sums(const Film::PixelSums& sums, PartReader& reader) {
  return with_sums(sums, [&](auto&... fields) { return reader.get_each(fields...); });
}

/// Writes the sums of a refined pixel.
inline void write_halves(const Film::PixelSums& sums, PartWriter& writer) {
  const PixelState& state = *sums.state;
  writer.put_each(state.half_count[0], state.half_count[1]);
  if (!state.begun()) return;
  writer.put_each(state.half[0], state.half[1], state.squares[0], state.squares[1], state.squares[2]);
  write_sums(sums, writer);
}
/// Reads them, with at most `half` samples in each half.
inline bool read_halves(const Film::PixelSums& sums, std::uint32_t half, PartReader& reader) {
  PixelState& state = *sums.state;
  if (!reader.get_each(state.half_count[0], state.half_count[1])) return false;
  if (state.half_count[0] > half || state.half_count[1] > half) return false;
  if (!state.begun()) return true;
  return reader.get_each(state.half[0], state.half[1], state.squares[0], state.squares[1], state.squares[2]) &&
         read_sums(sums, reader);
}

/// The pilot of every pixel.
template <Tracer T>
class PilotRound final : public PartRound {
 public:
  PilotRound(Film& film, const Tiles& tiles, Pilots<T>& pilots, PreviewTiles& preview)
      : film_(film), tiles_(tiles), pilots_(pilots), preview_(preview) {}
  [[nodiscard]] PartKind kind() const override { return PartKind::pilots; }
  [[nodiscard]] std::uint64_t count() const override { return tiles_.count(); }
  [[nodiscard]] std::uint64_t samples(std::uint64_t unit) const override { return tiles_.window(unit).pixels(); }
  void describe(std::uint64_t unit, PartWriter& writer) const override { writer.put(unit); }
  bool store(std::uint64_t unit, PartReader& result) override {
    PreviewTiles::Tile tile(preview_, unit);
    const std::lock_guard lock(tile);
    float cost = 0;
    if (!result.get(cost)) return false;
    for (const Pixel& pixel : tiles_.pixels(unit)) {
      const Film::PixelSums sums = film_.sums(tiles_.place(pixel));
      if (!result.get_each(sums.rgb[0], sums.rgb[1], sums.rgb[2]) || !read_sums(sums, result)) return false;
    }
    pilots_.set_traced(unit, cost);
    return true;
  }

 private:
  Film& film_;
  const Tiles& tiles_;
  Pilots<T>& pilots_;
  PreviewTiles& preview_;
};

template <Tracer T>
UnitOutcome trace_pilot_unit(const CompiledScene& scene, PartReader& unit, T& tracer, PartWriter& result) {
  std::uint64_t tile = 0;
  const Tiles tiles(scene.image.window());
  if (!unit.get(tile) || tile >= tiles.count()) return UnitOutcome::malformed;
  TileFilm own(scene, tiles.window(tile));
  Pilots<T> pilots(scene, own.film, own.tiles, own.never, own.preview);
  pilots.trace(0, 1, tracer);
  if (!pilots.complete()) return UnitOutcome::cancelled;
  result.put(pilots.cost(0));
  for (const Pixel& pixel : own.tiles.pixels(0)) {
    const Film::PixelSums sums = own.film.sums(own.tiles.place(pixel));
    result.put_each(sums.rgb[0], sums.rgb[1], sums.rgb[2]);
    write_sums(sums, result);
  }
  return UnitOutcome::traced;
}

/// Samples that continue the halves of some pixels.
class AllocatedRound final : public PartRound {
 public:
  /// `half`: samples in each half after the round, by place; 0: unchanged.
  AllocatedRound(Film& film, const Tiles& tiles, PreviewTiles& preview, const std::vector<std::uint32_t>& half)
      : film_(film), tiles_(tiles), preview_(preview), half_(half) {
    for (std::uint64_t tile = 0; tile < tiles.count(); ++tile) {
      std::uint64_t samples = 0;
      each_pixel(tile, [&](std::uint16_t, std::size_t place) {
        for (const std::uint32_t count : film_.pixel(place).half_count)
          samples += half_[place] - std::min(half_[place], count);
        return true;
      });
      if (samples > 0) units_.push_back({tile, samples});
    }
  }
  [[nodiscard]] PartKind kind() const override { return PartKind::round; }
  [[nodiscard]] std::uint64_t count() const override { return units_.size(); }
  [[nodiscard]] std::uint64_t samples(std::uint64_t unit) const override { return units_[unit].samples; }
  void describe(std::uint64_t unit, PartWriter& writer) const override {
    writer.put(units_[unit].tile);
    each_pixel(units_[unit].tile, [&](std::uint16_t at, std::size_t place) {
      writer.put_each(at, half_[place]);
      write_halves(film_.sums(place), writer);
      return true;
    });
  }
  bool store(std::uint64_t unit, PartReader& result) override {
    PreviewTiles::Tile tile(preview_, units_[unit].tile);
    const std::lock_guard lock(tile);
    return each_pixel(units_[unit].tile, [&](std::uint16_t, std::size_t place) {
      return read_halves(film_.sums(place), half_[place], result);
    });
  }

 private:
  struct Unit {
    std::uint64_t tile, samples;
  };
  /// Calls use(index in the tile, place) for each pixel with samples, while it returns true.
  template <class Use>
  bool each_pixel(std::uint64_t tile, const Use& use) const {
    std::uint16_t at = 0;
    for (const Pixel& pixel : tiles_.pixels(tile)) {
      const std::size_t place = tiles_.place(pixel);
      if (half_[place] > 0 && !use(at, place)) return false;
      ++at;
    }
    return true;
  }

  Film& film_;
  const Tiles& tiles_;
  PreviewTiles& preview_;
  const std::vector<std::uint32_t>& half_;
  std::vector<Unit> units_;
};

template <Tracer T>
UnitOutcome trace_allocated_unit(const CompiledScene& scene, const RenderControl& control, PartReader& unit, T& tracer,
                                 PartWriter& result) {
  std::uint64_t tile = 0;
  const Tiles tiles(scene.image.window());
  if (!unit.get(tile) || tile >= tiles.count() || !scene.accuracy.adaptive) return UnitOutcome::malformed;
  TileFilm own(scene, tiles.window(tile));
  own.film.begin({});
  const std::vector<Pixel> pixels = own.tiles.pixels(0);
  std::vector<std::uint32_t> half(pixels.size());
  const std::uint32_t half_max = std::max(scene.accuracy.adaptive->samples_max, scene.accuracy.adaptive->samples_min);
  for (std::size_t next = 0; !unit.at_end();) {
    std::uint16_t at = 0;
    if (!unit.get(at) || at < next || at >= pixels.size()) return UnitOutcome::malformed;
    next = at + std::size_t{1};
    const std::size_t place = own.tiles.place(pixels[at]);
    if (!unit.get(half[place]) || half[place] == 0 || half[place] > half_max) return UnitOutcome::malformed;
    if (!read_halves(own.film.sums(place), half_max, unit)) return UnitOutcome::malformed;
  }
  RoundTracer<T>(scene, control, own.film, own.tiles, own.never, own.preview).trace(0, half, tracer);
  if (control.cancelled()) return UnitOutcome::cancelled;
  for (const Pixel& pixel : pixels)
    if (const std::size_t place = own.tiles.place(pixel); half[place] > 0) write_halves(own.film.sums(place), result);
  return UnitOutcome::traced;
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
template <Tracer T>
bool trace_looks(const CompiledScene& scene, const Tiles& tiles, std::span<const Look> looks, std::uint32_t half_size,
                 double share, T& tracer, std::span<std::optional<Halves>> means) {
  constexpr std::uint64_t first_stream = std::uint64_t{1} << 40;  // beyond the streams of the image
  Batch& batch = tracer.batch();
  batch.clear();
  batch.light_points = 2;
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

template <Tracer T>
UnitOutcome trace_look_unit(const CompiledScene& scene, bool exact, PartReader& unit, T& tracer, PartWriter& result) {
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
  if (!trace_looks<T>(scene, tiles, looks, half, look_share(scene, exact), tracer, halves))
    return UnitOutcome::cancelled;
  for (const std::optional<Halves>& entry : halves) {
    result.put(static_cast<std::uint8_t>(entry ? 1 : 0));
    if (entry) result.put_each((*entry)[0], (*entry)[1]);
  }
  return UnitOutcome::traced;
}

template <Tracer T>
UnitOutcome trace_unit(PartKind kind, const CompiledScene& scene, const RenderControl& control, PartReader& unit,
                       T& tracer, PartWriter& result) {
  switch (kind) {
    case PartKind::uniform:
      return trace_uniform_unit<T>(scene, unit, tracer, result);
    case PartKind::pilots:
      return trace_pilot_unit<T>(scene, unit, tracer, result);
    case PartKind::round:
      return trace_allocated_unit<T>(scene, control, unit, tracer, result);
    case PartKind::looks:
    case PartKind::exact_looks:
      return trace_look_unit<T>(scene, kind == PartKind::exact_looks, unit, tracer, result);
  }
  return UnitOutcome::malformed;
}

}  // namespace tracer
