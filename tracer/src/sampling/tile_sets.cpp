#include "tracer/src/sampling/tile_sets.h"

#include <algorithm>
#include <cmath>

#include "tracer/src/sampling/pixel_sums.h"

namespace tracer {
namespace {

/// A find is as different as this, in squared code values, summed over the channels.
constexpr double find_min = 3 * 40;

/// Numbers in [0, 1) that depend on the pixel and `purpose` alone.
class PixelChances {
 public:
  explicit PixelChances(const CompiledScene& scene) : width_(scene.image.width), key_(mix(~scene.accuracy.seed)) {}
  [[nodiscard]] double of(const Pixel& pixel, std::uint64_t purpose) const {
    const std::uint64_t index = static_cast<std::uint64_t>(pixel.y) * width_ + pixel.x;
    return static_cast<double>(static_cast<std::int64_t>(mix(mix(index ^ key_) + purpose) >> 11)) * 0x1p-53;
  }

 private:
  std::uint64_t width_, key_;
};

/// An even number.
std::uint32_t samples_of(const Film& film, std::size_t place, PixelClass c, const SetsPlan& plan) {
  const std::uint32_t count = film.count(place), most = (plan.samples_max - std::min(plan.samples_max, count)) & ~1u;
  if (plan.growth.empty()) return std::min(most, plan.samples[c]);
  const std::size_t x = place % film.width(), y = place / film.width();
  const std::size_t columns = (film.width() + TileErrors::side - 1) / TileErrors::side;
  const double growth = plan.growth[y / TileErrors::side * columns + x / TileErrors::side],
               wanted = growth * std::max(2u, count);
  const auto more = 2 * static_cast<std::uint32_t>(std::min(std::ceil(wanted / 2), most / 2.0));
  return std::min(most, std::max(plan.samples[c], more));
}

}  // namespace

std::vector<SampleSets> plan_tile(const CompiledScene& scene, const Film& film, const Tiles& tiles, std::uint64_t tile,
                                  std::span<const PixelClass> classes, const SetsPlan& plan) {
  constexpr std::uint32_t look_samples = 8;
  const PixelChances chances(scene);
  std::vector<SampleSets> sets;
  for (const Pixel& pixel : tiles.pixels(tile)) {
    const std::size_t place = tiles.place(pixel);
    const PixelClass c = classes[place];
    const bool keeps = plan.samples[c] == 0 && plan.growth.empty();
    if (keeps && plan.look_probability[c] == 0) continue;
    SampleSets one{.place = static_cast<std::uint32_t>(place),
                   .samples = keeps ? 0 : samples_of(film, place, c, plan),
                   .round = plan.round};
    if (one.samples > 0) {
      // The same pixels are measured in all rounds.
      const bool measured = film.count(place) > 0 ? film.error(place) >= 0 : chances.of(pixel, 0) < plan.measured[c];
      one.kind = measured ? SampleSets::Kind::measured : SampleSets::Kind::joint;
    } else {
      if (film.count(place) > 0 || chances.of(pixel, plan.round + 1) >= plan.look_probability[c]) continue;
      one.kind = SampleSets::Kind::look;
      one.samples = look_samples;
    }
    sets.push_back(one);
  }
  return sets;
}

double squared_error(const Color& mean, const Color& deviation, const DisplayTransform& display) {
  double sum = 0;
  for (const auto channel : color_channels) {
    const double difference =
        display.level(mean.*channel) - display.level(std::max(0.0, mean.*channel - std::abs(deviation.*channel)));
    sum += difference * difference;
  }
  return sum;
}

void TileMerger::merge(const SampleSets& sets, const SetSums& sums, TileBook& book) const {
  const std::size_t place = sets.place;
  const bool halves = sums.count[0] > 0 && sums.count[1] > 0;
  if (sets.kind == SampleSets::Kind::look) {
    if (halves) look(place, sums, book);
    return;
  }
  const std::uint32_t count = sums.count[0] + sums.count[1];
  if (count == 0) return;
  const PixelClass c = classes_[place];
  ClassStatistics& statistics = book.classes[c];
  const bool before = film_.count(place) > 0;
  if (!before) {
    ++book.first_sets[c];
    film_.keep_pilot(place, plan_.pilot_weight[c]);
  }
  const double n = count, share = film_.share_of(place, n), old_decay = before ? film_.decay(place) : 0;
  const double of_pilot = !before && share < 1 && halves ? std::max(0.0, pilot_error(place, sums).squared) : 0;
  film_.add(place, sums);
  float& error = film_.error(place);
  const auto combined = [&](double old, double fresh) {
    return (1 - share) * (1 - share) * old + share * share * fresh;
  };
  const bool joint_before = before && error < 0;
  if (sets.kind == SampleSets::Kind::measured && halves && !joint_before) {
    const Color mean = (sums.mean[0] * sums.count[0] + sums.mean[1] * sums.count[1]) * (1.0 / n),
                deviation = (sums.mean[0] + sums.mean[1] * -1.0) * 0.5;
    const double fresh = squared_error(mean, deviation, display_), old = before ? std::max(0.0F, error) : 0;
    film_.add_deviation(place, share, deviation);
    const auto known = film_.deviation(place);
    const auto now = static_cast<float>(known ? squared_error(film_.mean(place), *known, display_)
                                              : combined(old + of_pilot, fresh));
    statistics.pixels += before ? 0 : 1;
    statistics.error += now - old;
    statistics.squares += double{now} * now - old * old;  // exact, so that nothing is left of what is replaced
    statistics.own += film_.decay(place) - old_decay;
    error = now;
    if (is_grown(c) && fresh > find_min) book.finds.push_back(static_cast<std::uint32_t>(place));
  } else {
    const double old = before ? std::max(0.0F, -error) : 0;
    const auto now = static_cast<float>(before ? combined(old, decay_.of(n)) : film_.decay(place));
    statistics.others += now - old;
    error = -now;
  }
}

/// (P - F1)(P - F2), whose expectation is the squared error of the pilot P. If a half differs much, the square of the
/// distance to the mean of both is taken, which is larger: where few samples hit something, both halves rarely do.
TileMerger::PilotError TileMerger::pilot_error(std::size_t place, const SetSums& sums) const {
  const Color pilot = film_.mean(place);
  double product = 0, first = 0, second = 0, both = 0;
  for (const auto channel : color_channels) {
    const double one = sums.mean[0].*channel, other = sums.mean[1].*channel, own = display_.level(pilot.*channel),
                 a = own - display_.level(one), b = own - display_.level(other),
                 mean = own -
                        display_.level((one * sums.count[0] + other * sums.count[1]) / (sums.count[0] + sums.count[1]));
    product += a * b;
    first += a * a;
    second += b * b;
    both += mean * mean;
  }
  const bool find = std::max(first, second) > find_min + 16 * plan_.kept[classes_[place]];
  return {find ? std::max(product, both) : product, find};
}

void TileMerger::look(std::size_t place, const SetSums& sums, TileBook& book) const {
  const PixelClass c = classes_[place];
  const auto [error, find] = pilot_error(place, sums);
  const double weight = 1 / plan_.look_probability[c];
  const LookStatistics one{1, error * weight, error * error * weight * weight, weight, plan_.kept[c] * weight};
  book.looks.all[c].add(one);
  if (!find) return;
  book.looks.finds[c].add(one);
  book.finds.push_back(static_cast<std::uint32_t>(place));
}

}  // namespace tracer
