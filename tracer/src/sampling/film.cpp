#include "tracer/src/sampling/film.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

#include "tracer/src/sampling/camera_samples.h"

namespace tracer {
namespace {

/// The largest of `most`, most / 4, most / 16, ... for which the bounds below it are small together.
double certified_limit(std::span<const PixelState> pixels, double most) {
  for (double limit = most;; limit /= 4) {
    double sum = 0;
    for (const PixelState& pixel : pixels) sum += pixel.bound <= limit ? pixel.bound : 0;
    if (9 * sum <= most * static_cast<double>(pixels.size())) return limit;
  }
}

/// Adds to `range` a pixel's brightest channel: that of its samples, and of a part that they may have missed. A bright
/// pilot may be all that is bright. `noise`: variance of a sample of similar pixels, by channel: the brightest pixel of
/// many is likely one whose samples vary too little, and may be as noisy as they, up to a limit.
void add_pixel(const PixelState& pixel, const RadianceInterval* bounds, bool only_positions_vary,
               const std::array<double, 3>& noise, const DisplayTransform& display, BrightestRange& range) {
  // Few samples may agree by chance, and then bound the brightest channel from below: what is predicted, if it is more,
  // counts as much as this number of samples.
  constexpr double prior_samples = 8, noise_max = 4;
  const std::array<double, 3> mean{pixel.mean().r, pixel.mean().g, pixel.mean().b};
  const double count = pixel.count(), prior = prior_samples / (prior_samples + count - 1);
  // Light in a smooth surface has any height within the interval, as in SuspectedErrors.
  const double height = pixel.refined() && !pixel.edge ? std::numbers::inv_sqrt3 : 1;
  const double missed = !pixel.refined() && pixel.certified ? 1 : height * missed_share(count);
  const double darker = !pixel.refined() ? 1 : pixel.edge ? missed : 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const double value = mean[i], slope = display.slope(std::min(value, display.white()));
    const double low = bounds == nullptr ? value : std::min(value, double{bounds->low[i]});
    double high = bounds == nullptr ? value : std::max(value, double{bounds->high[i]});
    if (!std::isfinite(high)) high = pixel.refined() ? value : 1e30;
    double variance = 0;
    if (pixel.refined() && count > 1) {
      // Stratification helps half as much as usual, see expected_refined_error().
      const double deviation = only_positions_vary && pixel.measured()
                                   ? stratified_deviation_of_mean(pixel, i)
                                   : deviation_of_mean(pixel, i) * std::pow(count / 2, (1 - variance_power) / 4);
      const double own = deviation * deviation;
      variance = std::max(own, std::min(noise[i] / count, noise_max * own));
      if (slope > 0) variance += prior * std::max(0.0, pixel.variance / (3 * slope * slope) - variance);
    }
    range.add(value, std::sqrt(variance), (value - low) * darker, (high - value) * missed);
  }
}

/// Calls use(place) for a pixel and its neighbors.
template <class Use>
void each_neighbor(std::size_t place, std::size_t width, std::size_t size, const Use& use) {
  const std::size_t x = place % width, y = place / width, rows = size / width;
  for (std::size_t ny = y - std::min<std::size_t>(y, 1); ny <= std::min(y + 1, rows - 1); ++ny)
    for (std::size_t nx = x - std::min<std::size_t>(x, 1); nx <= std::min(x + 1, width - 1); ++nx) use(ny * width + nx);
}

template <class Work>
void each_place(const InParallel& in_parallel, const Blocks& blocks, const Work& work) {
  in_parallel(blocks.count(), [&](std::uint64_t block) {
    blocks.each_pixel(block, [&](std::size_t place, std::size_t, std::size_t) { work(place); });
  });
}

}  // namespace

Film::Film(const CompiledScene& scene, const PixelWindow& window, const InParallel& in_parallel)
    : scene_(scene), in_parallel_(in_parallel), width_(window.width()), size_(window.pixels()), rgb_(3 * size_) {
  if (scene.needs.layers) layers_.resize(size());
  if (has_secondary_rays(scene.needs) || scene.needs.many_lights) omitted_.resize(size());
}

void Film::set_preview_block(std::size_t place, std::uint32_t side, const Color& radiance,
                             const std::vector<OmittedRadiance>& omitted, const GBuffer& gbuffer, std::size_t sample) {
  discard_samples(place);
  add_sample(place, omitted, gbuffer, sample);
  write_color(&rgb_[3 * place], radiance);
  if (side > 1) fill_block(place, side, place);
}

void Film::fill_block(std::size_t place, std::uint32_t side, std::size_t source) {
  const std::array<float, 3> color{rgb_[3 * source], rgb_[3 * source + 1], rgb_[3 * source + 2]};
  const std::size_t columns = std::min<std::size_t>(side, width_ - place % width_);
  for (std::size_t row = place; row < std::min(size_, place + std::size_t{side} * width_); row += width_) {
    for (std::size_t at = row; at < row + columns; ++at) {
      std::copy(color.begin(), color.end(), rgb_.begin() + static_cast<std::ptrdiff_t>(3 * at));
      if (!omitted_.empty()) omitted_[at] = omitted_[source];
      if (!layers_.empty()) layers_[at] = layers_[source];
    }
  }
}

void Film::begin(std::vector<RadianceInterval> bounds) {
  bounds_ = std::move(bounds);
  pixels_.resize(size());
  each_place(in_parallel_, Blocks(size_, width_), [&](std::size_t i) {
    pixels_[i].pilot = {rgb_[3 * i], rgb_[3 * i + 1], rgb_[3 * i + 2]};
    if (!bounds_.empty()) pixels_[i].edge = bounds_[i].edge;
  });
}

void Film::certify(double certified) {
  if (bounds_.empty()) return;
  const DisplayTransform to_display = display();
  each_place(in_parallel_, Blocks(size_, width_),
             [&](std::size_t i) { pixels_[i].bound = squared_error_bound(bounds_[i], to_display); });
  const double limit = certified_limit(pixels_, certified);
  each_place(in_parallel_, Blocks(size_, width_),
             [&](std::size_t i) { pixels_[i].certified = pixels_[i].bound <= limit; });
}

void Film::add_sample(std::size_t place, const std::vector<OmittedRadiance>& omitted, const GBuffer& gbuffer,
                      std::size_t sample) {
  if (!omitted_.empty()) omitted_[place] += omitted[sample];
  if (!layers_.empty()) layers_[place].add(gbuffer, sample);
}

void Film::discard_samples(std::size_t place) {
  if (!omitted_.empty()) omitted_[place] = {};
  if (!layers_.empty()) layers_[place] = {};
}

Film::PixelSums Film::sums(std::size_t place) {
  return {&rgb_[3 * place], pixels_.empty() ? nullptr : &pixels_[place], omitted_.empty() ? nullptr : &omitted_[place],
          layers_.empty() ? nullptr : &layers_[place]};
}

void Film::add_feature(std::size_t place, const SubpixelFeature& feature, const Color& radiance,
                       const DisplayTransform& display) {
  PixelState& pixel = pixels_[place];
  double difference = 0, missed = 0;
  for (const auto channel : {&Color::r, &Color::g, &Color::b}) {
    const double pilot = pixel.pilot.*channel, found = radiance.*channel, pilot_code = display.level(pilot);
    const double mean = pilot + (found - pilot) * feature.share;
    difference += (display.level(found) - pilot_code) * (display.level(found) - pilot_code);
    missed += (display.level(mean) - pilot_code) * (display.level(mean) - pilot_code);
  }
  if (!(difference > 0)) return;
  pixel.hidden += static_cast<float>(difference * feature.share * (1 - feature.share));
  pixel.missed += static_cast<float>(missed);
  pixel.hidden_share = std::min(pixel.hidden_share, feature.share);
}

void Film::predict_variance(const DisplayTransform& display) {
  const Blocks blocks(size_, width_);
  in_parallel_(blocks.count(), [&](std::uint64_t block) {
    ContrastRows contrasts(width_, size_ / width_, [&](std::size_t y, CodeValueRow& row) {
      display.show(std::span(rgb_).subspan(3 * y * width_, 3 * std::size_t{width_}), row);
    });
    for (std::size_t y = blocks.first_row(block); y < blocks.first_row(block + 1); ++y) {
      PixelState* pixel = pixels_.data() + y * width_;
      for (const float contrast : contrasts.row(y)) {
        pixel->contrast = contrast;
        const double variance = std::min(predicted_variance(contrast), double{pixel->bound});
        pixel->variance = static_cast<float>(std::max(variance, pixel->undetected()));
        ++pixel;
      }
    }
  });
}

void Film::raise_variance(std::size_t place, double error) {
  constexpr double surprise = 16, neighbor_share = 1.0 / 4;
  if (!pixels_[place].open() || !(error > surprise * pixels_[place].variance)) return;
  each_neighbor(place, width_, size_, [&](std::size_t neighbor) {
    PixelState& pixel = pixels_[neighbor];
    if (pixel.open()) pixel.variance = std::max(pixel.variance, static_cast<float>(error * neighbor_share));
  });
  pixels_[place].variance = static_cast<float>(error);
  pixels_[place].repaired = true;
}

DisplayTransform Film::display() const {
  double brightest = 0;
  if (scene_.output.overflow == Output::Overflow::scale)
    for (std::size_t i = 0; i < size(); ++i) brightest = std::max(brightest, max_component(mean(i)));
  return {scene_.output, brightest};
}

Color Film::mean(std::size_t place) const {
  if (!pixels_.empty()) return pixels_[place].mean();
  return {rgb_[3 * place], rgb_[3 * place + 1], rgb_[3 * place + 2]};
}

OmittedError Film::omitted_error(const DisplayTransform& display) {
  const auto omits = [](const OmittedRadiance& omitted) {
    return omitted.depth != 0 || omitted.cutoff != 0 || omitted.culled != 0;
  };
  if (std::ranges::none_of(omitted_, omits)) return {};
  update_means();
  const ErrorContext context{display, omitted_bound(), scene_.output};
  const Blocks blocks(size_, width_);
  return sum_in_parallel<OmittedError>(in_parallel_, blocks.count(), [&](std::uint64_t block, OmittedError& sum) {
    blocks.each_pixel(block, [&](std::size_t i, std::size_t, std::size_t) {
      add(sum, rgb_.data() + 3 * i, mean_omitted(i), context);
    });
  });
}

BrightestRange Film::brightest(std::vector<BrightestRange>& pixels) const {
  const DisplayTransform shown = display();
  const bool only_positions_vary = !scene_.needs.lens && !uses_random_choices(scene_);
  const auto range_with = [&](double deviations, const std::array<double, 3>& noise) {
    BrightestRange all{.deviations_below = deviations};
    pixels.assign(size(), all);
    each_place(in_parallel_, Blocks(size_, width_), [&](std::size_t i) {
      add_pixel(pixels_[i], bounds_.empty() ? nullptr : &bounds_[i], only_positions_vary, noise, shown, pixels[i]);
    });
    for (const BrightestRange& pixel : pixels) all.add(pixel);
    return all;
  };
  const double low = range_with(BrightestRange::deviations, {}).low;
  std::array<double, 3> noise{};
  double similar = 0, measured = 0;
  for (std::size_t i = 0; i < size(); ++i) {
    if (!(pixels[i].high > low)) continue;
    ++similar;
    if (only_positions_vary || !pixels_[i].refined() || pixels_[i].count() < 2) continue;
    ++measured;
    for (std::size_t c = 0; c < 3; ++c) noise[c] += std::pow(deviation_of_mean(pixels_[i], c), 2) * pixels_[i].count();
  }
  for (double& channel : noise) channel /= std::max(1.0, measured);
  return range_with(BrightestRange::deviations_of_largest(similar), noise);
}

double Film::tone_error() {
  if (scene_.output.overflow != Output::Overflow::scale) return 0;
  update_means();
  std::vector<BrightestRange> pixels;
  BrightestRange range;
  if (!pixels_.empty()) {
    range = brightest(pixels);
  } else {  // before refinement, pilots may have missed features as bright as the bound
    const double missed = missed_share(1), bound = omitted_bound().radiance;
    for (const float value : rgb_) range.add(value, 0, missed * value, missed * std::max(0.0, bound - value));
  }
  return tracer::tone_error(rgb_, scene_.output, range, in_parallel_);
}

void Film::raise_brightest(double tone_max, std::span<const float> cost, double cost_max, const Adaptive& limits,
                           SampleAllocation& allocation) {
  if (scene_.output.overflow != Output::Overflow::scale) return;
  constexpr double step = 0.01, least = 1e-4, most = 0.1;  // relative to the brightest channel
  std::vector<BrightestRange> ranges;
  const BrightestRange all = brightest(ranges);
  const double white = DisplayTransform(scene_.output, 0).white();  // less bright images are not scaled
  const double found = std::max(all.found, white), low = std::max(all.low, white);
  update_means();
  const double by_step = tracer::tone_error(rgb_, scene_.output, {found, found, found * (1 + step)}, in_parallel_);
  const double tolerance = by_step > 0 ? std::clamp(step * std::sqrt(tone_max / by_step), least, most) : most;
  std::vector<std::pair<double, std::size_t>> candidates;
  for (std::size_t i = 0; i < size(); ++i)
    if (ranges[i].high > (1 + tolerance) * std::max(low, ranges[i].low)) candidates.emplace_back(ranges[i].high, i);
  std::ranges::sort(candidates, std::greater<>());
  const auto raise = [&](std::size_t i, std::uint32_t wanted) {
    const std::uint32_t count = pixels_[i].count(), half = std::min(std::bit_floor(limits.samples_max), wanted) / 2;
    if (half <= std::max(count / 2, allocation.half[i])) return;
    cost_max -= (2.0 * half - count) * cost[i];
    if (cost_max < 0) return;
    allocation.half[i] = half;
    pixels_[i].role = PixelState::Role::refined;
    allocation.empty = false;
  };
  for (const auto& [high, i] : candidates) {
    const std::uint32_t wanted = pixels_[i].begun() ? 8 * pixels_[i].count() : 2 * refined_half;
    raise(i, wanted);
    each_neighbor(i, width_, size_, [&](std::size_t neighbor) {  // a small part of what is bright may lie there
      if (pixels_[neighbor].edge) raise(neighbor, wanted / 2);
    });
  }
}

TileErrors Film::tile_errors() const {
  TileErrors tiles(width_, size_ / width_);
  std::vector<float> row(pixels_.empty() ? 0 : width_);
  for (std::size_t y = 0; !row.empty() && y < size_ / width_; ++y) {
    for (std::size_t x = 0; x < width_; ++x) row[x] = pixels_[y * width_ + x].shown;
    tiles.add_row(y, row);
  }
  return tiles;
}

std::vector<ExcessTile> Film::excess_tiles(double target) const {
  std::vector<ExcessTile> tiles;
  tile_errors().each([&](const PixelWindow& window, double mean) {
    if (mean > 3 * target * target) tiles.push_back({window, mean / (3 * target * target)});
  });
  return tiles;
}

RadianceBound Film::omitted_bound() const { return bound_omitted_radiance(scene_, brightest_if_needed(scene_, rgb_)); }

void Film::update_means() {
  if (pixels_.empty()) return;
  each_place(in_parallel_, Blocks(size_, width_), [&](std::size_t i) {
    if (pixels_[i].refined()) write_color(&rgb_[3 * i], pixels_[i].mean());
  });
}

OmittedRadiance Film::mean_omitted(std::size_t place) const {
  if (omitted_.empty()) return {};
  const float share = pixels_.empty() ? 1 : 1.0f / static_cast<float>(pixels_[place].count());
  return omitted_[place] * share;
}

void Film::write_errors(std::vector<float>& error, const Image& image, const Outcome& outcome,
                        const ErrorContext& context) const {
  const double each = outcome.sampled.squared_upper / static_cast<double>(size_);  // without rounds
  double sum = 0, bounds = 0;
  for (const PixelState& pixel : pixels_) {
    sum += pixel.variance;
    bounds += pixel.open() ? pixel.bound : 0;
  }
  const double by_bound = bounds > 0 ? std::max(0.0, outcome.open) / bounds : 0;
  const auto shown = [&](const PixelState& pixel) {
    return pixel.open() ? std::max(double{pixel.shown}, by_bound * pixel.bound) : pixel.shown;
  };
  // An upper bound for parts of the image: the squared error of some 30 pixels exceeds its expectation by up to twice.
  constexpr double margin = 2.2;
  const double factor = margin * (sum > 0 ? std::max(1.0, outcome.sampled.squared_upper / sum) : 1);
  each_place(in_parallel_, Blocks(size_, width_), [&](std::size_t i) {
    const double variance = pixels_.empty() ? each : shown(pixels_[i]) * factor;
    error[i] = pixel_error(variance, image.rgb.data() + 3 * i, mean_omitted(i), context);
  });
}

void Film::count(RenderStatistics& statistics) const {
  statistics.samples_min = std::numeric_limits<std::uint32_t>::max();
  std::uint64_t in_means = 0;
  for (const PixelState& pixel : pixels_) {
    const std::uint32_t samples = pixel.count();
    in_means += samples;
    statistics.samples_min = std::min(statistics.samples_min, samples);
    statistics.samples_max = std::max(statistics.samples_max, samples);
  }
  statistics.holdout_samples = statistics.samples - in_means;
}

void Film::write(Rendered& rendered, const Outcome& outcome) {
  if (pixels_.empty()) {
    rendered.statistics.samples_min = outcome.complete ? 1 : 0;
    rendered.statistics.samples_max = 1;
  } else {
    count(rendered.statistics);
    update_means();
  }
  Image& image = rendered.image;
  const ErrorContext context{display(), omitted_bound(), scene_.output};
  image.rgb = std::move(rgb_);
  allocate(image, scene_.image.window(), scene_.output);
  if (!layers_.empty())
    each_place(in_parallel_, Blocks(size_, width_), [&](std::size_t i) { layers_[i].write(image, i); });
  if (!image.layers.error.empty()) write_errors(image.layers.error, image, outcome, context);
}

}  // namespace tracer
