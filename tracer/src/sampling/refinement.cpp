#include "tracer/src/sampling/refinement.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace tracer {

void Refinement::classify(std::span<const float> features, const DisplayTransform& display,
                          const InParallel& in_parallel) {
  std::array<std::vector<float>, 3> code_values;
  code_values.fill(std::vector<float>(film_.size()));
  const Blocks blocks(film_.size(), film_.width());
  in_parallel(blocks.count(), [&](std::uint64_t block) {
    const std::size_t first = blocks.first_row(block) * film_.width(),
                      end = blocks.first_row(block + 1) * film_.width();
    display.show(film_.rgb().subspan(3 * first, 3 * (end - first)),
                 {&code_values[0][first], &code_values[1][first], &code_values[2][first]});
  });
  const PilotImage pilots{film_.width(),      film_.height(), {code_values[0], code_values[1], code_values[2]},
                          film_.signatures(), features,       !decay_.stratified};
  counts_.resize(tiles_.count());
  in_parallel(tiles_.count(),
              [&](std::uint64_t tile) { counts_[tile] = tracer::classify(pilots, tiles_.places(tile), classes_); });
  ByClass<ClassCount> counts{};
  for (const auto& tile : counts_)
    for (std::size_t c = 0; c < class_count; ++c) counts[c].add(tile[c]);
  allocation_.emplace(counts, decay_);
  for (std::size_t c = 0; c < class_count; ++c) left_[c] = pixels_[c] = counts[c].pixels;
  kept_ = pixels_;
  for (std::size_t place = 0; place < film_.size(); ++place) {
    if (film_.count(place) == 0) continue;
    --kept_[classes_[place]];
    const double error = film_.error(place);
    found_.classes[classes_[place]].add({1, error, error * error, film_.decay(place), 0});
  }
}

void Refinement::scale_errors(double scale) {
  found_.scale(scale);
  looks_before_.scale(scale);
  if (allocation_) allocation_->scale(scale);
}

double Refinement::wanted() const {
  const double error = target_.target_error.value_or(target_.tile_error.value_or(invisible_error));
  return channels() * error * error;
}

/// If what samples cannot lower prevents the target, looks alone show the rest: any error is small enough. Without a
/// target the rest need not be smaller than that.
double Refinement::goal() const {
  constexpr double any = 255.0 * 255;
  if (leaves_room()) return wanted() - fixed_;
  return target_.target_error || target_.tile_error ? channels() * any : fixed_;
}

bool Refinement::begin_round() {
  if (rounds_ == rounds_max) return false;
  done_ = 0;
  for (std::size_t c = 0; c < class_count; ++c) {
    // Tiles of the first steps may have fewer samples than others: as many count as their mean error is worth.
    const ClassStatistics& found = found_.classes[c];
    const double worth = found.own > 0 ? std::pow(found.pixels / found.own, 1 / decay_.power()) : 0;
    before_[c] = found.own > 0      ? std::min(sampled_[c], static_cast<std::uint32_t>(std::lround(worth)))
                 : found.others > 0 ? sampled_[c]
                                    : 0;
  }
  if (rounds_ > 0) grow();
  ++rounds_;
  return true;
}

/// Uncertainty that further samples do not lower is that of looks. False if there have been enough.
bool Refinement::take_more_looks() {
  constexpr double most = 64;
  if (look_factor_ >= most) return false;
  look_factor_ = std::min(most, 4 * look_factor_);
  looks_before_ = std::exchange(found_.looks, {});
  fresh_looks_ = true;
  return true;
}

/// Pixels around finds get samples in the next round: what looks have found, such as a line, often continues. The looks
/// at other pixels then start again, since those before have decided about what is left.
void Refinement::grow() {
  constexpr std::size_t reach = 6, finds_max = 256;  // the statistics of the classes show more than that
  const std::size_t width = film_.width(), height = film_.height();
  const PixelClass grown = grown_class(rounds_ - 1);
  if (found_.finds.size() > finds_max) found_.finds.clear();
  for (const std::uint32_t place : found_.finds) {
    const std::size_t x = place % width, y = place / width;
    for (std::size_t row = y - std::min(y, reach); row < std::min(height, y + reach + 1); ++row)
      for (std::size_t at = row * width + x - std::min(x, reach); at < row * width + std::min(width, x + reach + 1);
           ++at) {
        if (film_.count(at) > 0 || is_grown(classes_[at])) continue;
        for (ByClass<double>* const pixels : {&pixels_, &kept_}) {
          --(*pixels)[classes_[at]];
          ++(*pixels)[grown];
        }
        classes_[at] = grown;
      }
  }
  found_.finds.clear();
  if (pixels_[grown] == 0) return;
  look_factor_ /= 2;  // to be doubled: looks follow what earlier ones found
  take_more_looks();
}

std::optional<Refinement::Step> Refinement::next_step(double rays) {
  const std::uint64_t count = tiles_.count();
  const bool first_round = rounds_ == 1;
  if (done_ == count) return std::nullopt;
  Step step{.first = done_, .last = count};
  if (first_round) {
    const std::uint64_t tiles = done_ == 0 ? count / 64 : done_;  // twice as many as before, at most an eighth of all
    step.last = std::min(count, done_ + std::clamp<std::uint64_t>(tiles, 1, std::max<std::uint64_t>(1, count / 8)));
  }
  SetsPlan& plan = step.plan;
  plan.round = rounds_ - 1;
  plan.samples_max = target_.samples_max;
  plan.kept = error_of_pilots();
  plan.samples =
      first_round ? allocation_->solve(goal_of_first_round(rays), left_, found_.classes) : further_samples(rays);
  bool any = first_round || fresh_looks_;
  for (std::size_t c = 0; c < class_count; ++c) {
    const bool rarely_hit = pixel_kind(c) == PixelKind::feature || is_grown(c);  // one hit is most of the error
    plan.measured[c] = rarely_hit || !decay_.stratified
                           ? 1
                           : static_cast<float>(std::max(measured_share, measured_min / std::max(1.0, pixels_[c])));
    std::uint32_t& samples = plan.samples[c];
    if (is_grown(c) && pixels_[c] > 0) samples = std::max(samples, 4u);
    // The contrast shows noise only roughly, and further sets are worth as much as larger ones.
    if (!decay_.stratified) samples = std::min(samples, std::max(32u, 8 * before_[c]));
    if (target_.samples_min > 1) samples = std::max(samples, (target_.samples_min + 1) & ~1u);
    samples = std::min(samples, target_.samples_max & ~1u);
    plan.pilot_weight[c] = decay_.pilot_weight(pixel_kind(c));
    samples = decay_.further(samples, std::max<double>(before_[c], std::pow(plan.pilot_weight[c], 1 / decay_.power())));
    any |= samples > 0 && pixels_[c] > 0;
  }
  if (!first_round && target_.tile_error) {
    plan.growth = growth_of_tiles();
    any |= std::ranges::any_of(plan.growth, [](float growth) { return growth > 0; });
  }
  if (!any && !take_more_looks()) return std::nullopt;
  if (first_round || fresh_looks_) set_look_probabilities(plan);
  done_ = step.last;
  return step;
}

/// Samples of a further round, with which the stated error should meet the goal: that of each class and its uncertainty
/// fall alike.
ClassAllocation::Samples Refinement::further_samples(double rays) const {
  constexpr int steps = 4;
  constexpr double unknown = 0.1;  // squared relative uncertainty of classes without samples
  const double wanted = goal() * std::pow(0.97, rounds_ - 1);
  ClassAllocation::Goal goal{.squared_error = wanted, .rays = rays, .kept = error_of_pilots()};
  ByClass<ClassAllocation::Estimate> now{};
  for (std::size_t c = 0; c < class_count; ++c) {
    now[c] = allocation_->estimate(c, found_.classes[c]);
    if (pixels_[c] > 0) goal.kept[c] = (kept_[c] * goal.kept[c] + now[c].squared) / pixels_[c];
  }
  ClassAllocation::Samples samples{};
  for (int step = 0; step < steps; ++step) {
    samples = allocation_->solve(goal, pixels_, found_.classes);
    double squared = 0, variance = 0;
    for (std::size_t c = 0; c < class_count; ++c) {
      const double expected = samples[c] > before_[c]
                                  ? allocation_->variance(c, found_.classes[c]) * decay_.of(samples[c])
                                  : goal.kept[c],
                   error = pixels_[c] * expected;
      squared += error;
      variance += error * error * (now[c].squared > 0 ? now[c].variance / (now[c].squared * now[c].squared) : unknown);
    }
    const double stated = squared + error_deviations * std::sqrt(variance);
    goal.squared_error = std::clamp(goal.squared_error * wanted / stated, 0.4 * wanted, wanted);
  }
  return samples;
}

/// Goal of the first round in the tiles that are left. The stated error adds 2.33 deviations, of which the sums so far
/// show the size: the uncertainty of all tiles will be smaller.
ClassAllocation::Goal Refinement::goal_of_first_round(double rays) const {
  ByClass<double> pilots = kept_;
  for (std::size_t c = 0; c < class_count; ++c) pilots[c] -= left_[c];
  const Totals so_far = totals(pilots, false);
  const double wanted = goal(), done = static_cast<double>(done_) / static_cast<double>(tiles_.count());
  constexpr double finds_max = 0.05;  // the next round samples around them
  double share = 0.93;
  if (so_far.squared > 0) {
    const double full = done > 0 ? 1 / done : 1;
    const double finds = std::min(totals(pilots, true).squared - so_far.squared, finds_max * wanted);
    const double margin =
        error_deviations * std::sqrt(so_far.variance * full) / std::max(wanted, so_far.squared * full);
    share = std::clamp(1 - margin - finds / wanted, 0.75, 0.98);
  }
  // Tiles that have used more than their part are made up for by further rounds rather than by the rest of the tiles.
  const double part_min = decay_.stratified ? 0.8 : 0.9, squared = wanted * share;
  return {.squared_error = std::max(squared - so_far.squared, part_min * squared * (1 - done)),
          .rays = rays,
          .kept = error_of_pilots(),
          .may_be_uniform = true};
}

/// Looks are spread evenly over each of three groups of pixels that keep their pilot: smooth ones, those that show
/// something in a mirror or through glass, and the others.
void Refinement::set_look_probabilities(SetsPlan& plan) const {
  constexpr std::array<double, 3> looks{768, 1024, 512};
  const auto group_of = [](std::size_t c) -> std::size_t {
    return pixel_kind(c) == PixelKind::smooth ? 0 : pixel_kind(c) == PixelKind::reflecting ? 1 : 2;
  };
  const auto gets_looks = [&](std::size_t c) { return plan.samples[c] == 0 && pixel_kind(c) != PixelKind::feature; };
  std::array<double, 3> pixels{};
  for (std::size_t c = 0; c < class_count; ++c)
    if (gets_looks(c)) pixels[group_of(c)] += pixels_[c];
  for (std::size_t c = 0; c < class_count; ++c)
    if (gets_looks(c))
      plan.look_probability[c] = std::min(1.0, looks[group_of(c)] * look_factor_ / std::max(1.0, pixels[group_of(c)]));
}

/// Further samples of pixels in tiles whose error exceeds the target, relative to those that they have.
std::vector<float> Refinement::growth_of_tiles() const {
  const double target = 3 * *target_.tile_error * *target_.tile_error,
               allowed = std::max(0.1 * target, target - 3 * fixed_ / channels());
  std::vector<float> growth;
  tile_errors().each([&](const PixelWindow&, double mean) {
    growth.push_back(mean > allowed ? static_cast<float>(std::pow(1.2 * mean / allowed - 1, 1 / decay_.power())) : 0);
  });
  return growth;
}

void Refinement::add(const TileBook& book) {
  found_.add(book);
  for (std::size_t c = 0; c < class_count; ++c) kept_[c] -= book.first_sets[c];
  allocation_->learn(found_.classes);
}

void Refinement::add(const Step& step, const TileBook& book) {
  add(book);
  if (rounds_ == 1)
    for (std::uint64_t i = step.first; i < step.last; ++i)
      for (std::size_t c = 0; c < class_count; ++c) left_[c] -= counts_[tiles_.scattered(i)][c].pixels;
  for (std::size_t c = 0; c < class_count; ++c) sampled_[c] = std::max(sampled_[c], before_[c] + step.plan.samples[c]);
  if (step.last == tiles_.count()) fresh_looks_ = false;
}

/// Measured error of smooth pilots over the expected one.
double Refinement::look_scale() const {
  constexpr double enough = 100;
  LookStatistics sum;
  for (std::size_t c = 0; c < class_count; ++c)
    if (!is_mixed(c)) sum.add(valid_looks().all[c]);
  if (sum.looks < enough || !(sum.expected > 0)) return 1;
  return std::clamp(sum.error / sum.expected, 0.25, 4.0);
}

/// Result of the looks at a class. The error that its contrast predicts, corrected by the looks at all smooth pixels,
/// counts as much as a few looks.
LookStatistics Refinement::shown_by_looks(std::size_t c, double scale, bool with_finds) const {
  constexpr double prior_looks = 8;
  LookStatistics shown = valid_looks().all[c];
  if (!with_finds && leaves_out_finds(c)) {
    shown.error -= valid_looks().finds[c].error;
    shown.squares -= valid_looks().finds[c].squares;
  }
  shown.expected = allocation_->kept(c, found_.classes[c]) * (is_mixed(c) ? 1 : scale);
  const double prior = prior_looks / (prior_looks + shown.looks), predicted = prior * shown.expected * shown.pixels;
  shown.error = (1 - prior) * shown.error + predicted;
  shown.squares = (1 - prior) * (1 - prior) * shown.squares + predicted * predicted;
  return shown;
}

/// Expected error of a pixel that keeps its pilot, by class.
ByClass<double> Refinement::error_of_pilots() const {
  const double scale = look_scale();
  ByClass<double> errors{};
  for (std::size_t c = 0; c < class_count; ++c) {
    const LookStatistics looks = shown_by_looks(c, scale, false);
    errors[c] = looks.pixels > 0 ? std::max(0.0, looks.error / looks.pixels) : looks.expected;
  }
  return errors;
}

Refinement::Totals Refinement::totals(const ByClass<double>& pilots, bool with_finds) const {
  const double scale = look_scale();
  Totals totals;
  double of_pilots = 0;
  for (std::size_t c = 0; c < class_count; ++c) {
    const ClassAllocation::Estimate sampled = allocation_->estimate(c, found_.classes[c]);
    totals.squared += sampled.squared;
    totals.variance += sampled.variance;
    if (!(pilots[c] > 0)) continue;
    const LookStatistics shown = shown_by_looks(c, scale, with_finds);
    const bool known = shown.pixels > 0;
    of_pilots += pilots[c] * (known ? shown.error / shown.pixels : shown.expected);
    totals.variance +=
        std::pow(pilots[c], 2) * (known ? shown.squares / std::pow(shown.pixels, 2) : std::pow(shown.expected, 2));
  }
  totals.squared += std::max(0.0, of_pilots);
  return totals;
}

SampledError Refinement::error() const {
  const Totals all = totals(kept_, true);
  return {all.squared, all.squared + error_deviations * std::sqrt(all.variance)};
}

std::uint64_t Refinement::looks() const {
  double looks = 0;
  for (const LookStatistics& one : valid_looks().all) looks += one.looks;
  return static_cast<std::uint64_t>(looks);
}

std::vector<float> Refinement::pixel_errors() const {
  ByClass<float> kept{}, joint{};
  for (std::size_t c = 0; c < class_count; ++c) {
    kept[c] = static_cast<float>(allocation_->kept(c, found_.classes[c]));
    joint[c] = static_cast<float>(decay_.joint() * allocation_->variance(c, found_.classes[c]));
  }
  std::vector<float> errors(film_.size());
  for (std::size_t place = 0; place < film_.size(); ++place) {
    const std::size_t c = classes_[place];
    const float error = film_.error(place);
    errors[place] = film_.count(place) == 0 ? kept[c] : error >= 0 ? error : -error * joint[c];
  }
  return errors;
}

TileErrors Refinement::tile_errors() const { return {film_.width(), film_.height(), pixel_errors()}; }

}  // namespace tracer
