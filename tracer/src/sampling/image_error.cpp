#include "tracer/src/sampling/image_error.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "tracer/src/math/lanes.h"
#include "tracer/src/sampling/brightest_pixel.h"
#include "tracer/src/sampling/pixel_sums.h"
#include "tracer/src/sampling/tile_errors.h"
#include "tracer/src/textures/texture.h"

namespace tracer {
namespace {

constexpr std::size_t no_row = std::numeric_limits<std::size_t>::max();

WHITTLE_INLINE float squared_second_difference(float before, float at, float after) {
  const float difference = before - 2 * at + after;
  return difference * difference;
}

/// Raises the contrasts of the pixels x in [first, last) of row `at` to the contrast in one direction: `step` to the
/// left in row `before` and `step` to the right in row `after`.
WHITTLE_WIDE void raise_contrast(const CodeValueRow& before, const CodeValueRow& at, const CodeValueRow& after,
                                 std::ptrdiff_t step, std::ptrdiff_t first, std::ptrdiff_t last, float* contrast) {
  const float *const r0 = before[0].data(), *const g0 = before[1].data(), *const b0 = before[2].data();
  const float *const r1 = at[0].data(), *const g1 = at[1].data(), *const b1 = at[2].data();
  const float *const r2 = after[0].data(), *const g2 = after[1].data(), *const b2 = after[2].data();
  for (std::ptrdiff_t x = first; x < last; ++x) {
    const float sum = squared_second_difference(r0[x - step], r1[x], r2[x + step]) +
                      squared_second_difference(g0[x - step], g1[x], g2[x + step]) +
                      squared_second_difference(b0[x - step], b1[x], b2[x + step]);
    contrast[x] = contrast[x] < sum ? sum : contrast[x];
  }
}

WHITTLE_WIDE void predict_variances(const float* contrast, std::size_t count, float* __restrict variance) {
  for (std::size_t x = 0; x < count; ++x) variance[x] = static_cast<float>(predicted_variance(contrast[x]));
}

/// Pixels [first, last) of the rows of a block.
struct Cell {
  std::size_t first, last, first_row, last_row;
  [[nodiscard]] double pixels() const { return static_cast<double>((last - first) * (last_row - first_row)); }
};

/// Spread of the pixels of a cell that is due to chance.
struct ChanceSpread {
  double squared = 0;  ///< sum of squared distances from the cell's mean, in squared code values
  double hits = 1;     ///< number of bright pixels that would have the same mean and spread
};

/// The spread of one channel. The cell's mean stands for the true value of its pixels. Of their variance around it,
/// chance causes what the pixels' deviations explain or, of a single sample, the differences between neighbors; the
/// rest is what the image shows.
ChanceSpread chance_spread(const UniformPixels& pixels, const DisplayTransform& display, const Cell& cell,
                           std::size_t channel, double chance_min) {
  double sum = 0, squares = 0, by_chance = 0;
  const auto each_value = [&](const auto& use) {
    for (std::size_t y = cell.first_row; y < cell.last_row; ++y)
      for (std::size_t x = cell.first; x < cell.last; ++x) use(3 * (y * pixels.width + x) + channel, x);
  };
  each_value([&](std::size_t i, std::size_t x) {
    const double value = pixels.rgb[i];
    sum += value;
    squares += value * value;
    if (!pixels.deviation.empty()) {
      by_chance += double{pixels.deviation[i]} * pixels.deviation[i];
    } else if (x > cell.first) {
      by_chance += std::pow(value - pixels.rgb[i - 3], 2) / 2;
    }
  });
  const double count = cell.pixels(), mean = sum / count, spread = squares - sum * mean;
  if (!(spread > 0) || by_chance < chance_min * spread) return {};
  const double level = display.level(mean);
  ChanceSpread result{0, sum * sum / squares};
  each_value([&](std::size_t i, std::size_t) { result.squared += std::pow(display.level(pixels.rgb[i]) - level, 2); });
  result.squared *= std::min(1.0, by_chance / spread);
  return result;
}

/// Squared error of a pixel whose samples have missed a feature of any height, in squared code values, summed over the
/// channels.
double unsearched_error(std::uint32_t samples) {
  constexpr double any_height = 3 * 255.0 * 255.0 / 3;  // the mean square is a third of the largest
  return any_height * std::pow(missed_share(samples), 2);
}

SampledError measure_samples(Image& image, const UniformPixels& pixels, const ErrorContext& context, TileErrors& tiles,
                             const InParallel& in_parallel) {
  const Blocks blocks(pixels.rgb.size() / 3, pixels.width);
  const auto add_block = [&](std::uint64_t block, SummedErrors& sum) {
    UniformVariance variances(pixels, context.display);
    const std::size_t first = blocks.first_row(block), last = blocks.first_row(block + 1);
    std::vector<float> all;  // rows of the block
    for (std::size_t y = first; y < last; ++y) {
      const std::span<const float> row = variances.row(y);
      all.insert(all.end(), row.begin(), row.end());
    }
    if (pixels.noisy) sum.add(add_rare_light(pixels, context.display, first, all));
    for (std::size_t y = first; y < last; ++y) {
      const auto variance = std::span<const float>(all).subspan((y - first) * pixels.width, pixels.width);
      sum.add(summed(variance));
      tiles.add_row(y, variance);
      if (image.layers.error.empty()) continue;
      float* const error = image.layers.error.data() + y * pixels.width;
      for (std::size_t x = 0; x < variance.size(); ++x) error[x] = rms_of_channels(variance[x]);
    }
  };
  SampledError error = sum_in_parallel<SummedErrors>(in_parallel, blocks.count(), add_block).estimated();
  if (pixels.indirect) error.add_possible(unsearched_error(pixels.samples));
  return error;
}

}  // namespace

ContrastRows::ContrastRows(std::size_t columns, std::size_t rows,
                           std::function<void(std::size_t, CodeValueRow&)> write_row)
    : columns_(columns), rows_(rows), write_row_(std::move(write_row)), contrast_(columns) {
  kept_row_.fill(no_row);
  for (CodeValueRow& row : kept_)
    for (std::vector<float>& plane : row) plane.resize(columns);
}

const CodeValueRow& ContrastRows::code_values(std::size_t y) {
  CodeValueRow& row = kept_[y % 3];
  if (kept_row_[y % 3] != y) write_row_(y, row);
  kept_row_[y % 3] = y;
  return row;
}

std::span<const float> ContrastRows::row(std::size_t y) {
  float* const contrast = contrast_.data();
  std::fill(contrast_.begin(), contrast_.end(), 0.0f);
  const auto columns = static_cast<std::ptrdiff_t>(columns_);
  const bool wide = columns >= 3, high = rows_ >= 3;
  const std::size_t middle = high ? std::clamp<std::size_t>(y, 1, rows_ - 2) : y;
  if (wide) {
    const CodeValueRow& own = code_values(y);
    raise_contrast(own, own, own, 1, 1, columns - 1, contrast);
    if (high) {
      raise_contrast(code_values(middle - 1), code_values(middle), code_values(middle + 1), 1, 1, columns - 1,
                     contrast);
      raise_contrast(code_values(middle - 1), code_values(middle), code_values(middle + 1), -1, 1, columns - 1,
                     contrast);
    }
    contrast_.front() = contrast_[1];
    contrast_.back() = contrast_[columns_ - 2];
  }
  if (high)
    raise_contrast(code_values(middle - 1), code_values(middle), code_values(middle + 1), 0, 0, columns, contrast);
  return contrast_;
}

UniformVariance::UniformVariance(const UniformPixels& pixels, const DisplayTransform& display)
    : pixels_(pixels),
      display_(display),
      contrasts_(pixels.width, pixels.rows(),
                 [this](std::size_t y, CodeValueRow& row) {
                   display_.show(pixels_.rgb.subspan(3 * y * pixels_.width, 3 * std::size_t{pixels_.width}), row);
                 }),
      variance_(pixels.width) {}

std::span<const float> UniformVariance::row(std::size_t y) {
  if (pixels_.deviation.empty()) {
    const std::span<const float> contrast = contrasts_.row(y);
    predict_variances(contrast.data(), contrast.size(), variance_.data());
  } else {
    for (std::size_t x = 0; x < pixels_.width; ++x) variance_[x] = variance_of(y * pixels_.width + x);
  }
  const std::size_t first = y * pixels_.width, last = first + pixels_.width;
  const auto begin = std::ranges::lower_bound(pixels_.missed, first, {}, &MissedFeature::place);
  for (auto missed = begin; missed != pixels_.missed.end() && missed->place < last; ++missed)
    variance_[missed->place - first] += missed->squared;
  return variance_;
}

float UniformVariance::variance_of(std::size_t pixel) const {
  double variance = 0;
  for (std::size_t i = 3 * pixel; i < 3 * pixel + 3; ++i) {
    if (pixels_.deviation[i] == 0) continue;  // true for most pixels of the background
    const double mean = pixels_.rgb[i], deviation = pixels_.deviation[i];
    const double slope = display_.slope_between(mean, std::max(0.0, mean - deviation));
    variance += slope * slope * deviation * deviation;
  }
  return static_cast<float>(variance);
}

std::vector<MissedFeature> missed_features(std::span<const SubpixelFeature> features, std::span<const Color> radiance,
                                           const UniformPixels& pixels, const PixelWindow& window,
                                           const DisplayTransform& display) {
  constexpr double hits_min = 4;
  const auto place_of = [&](const SubpixelFeature& feature) {
    return std::size_t{feature.y - window.y0} * pixels.width + (feature.x - window.x0);
  };
  const auto hit = [&](const SubpixelFeature& feature, const Color& found) {
    const std::size_t first = 3 * place_of(feature);
    for (std::size_t c = 0; c < 3 && !pixels.deviation.empty(); ++c) {
      const double change = std::abs(found.*color_channels[c] - pixels.rgb[first + c]) / pixels.samples;
      if (change > 0 && pixels.deviation[first + c] >= change / 2) return true;
    }
    return false;
  };
  std::vector<std::size_t> open;
  for (std::size_t i = 0; i < features.size(); ++i)
    if (finite(radiance[i]) && double{features[i].share} * pixels.samples < hits_min && !hit(features[i], radiance[i]))
      open.push_back(i);
  std::ranges::stable_sort(open, {}, [&](std::size_t i) { return place_of(features[i]); });
  std::vector<MissedFeature> missed;
  for (auto first = open.begin(), last = first; first != open.end(); first = last) {
    const std::size_t place = place_of(features[*first]);
    while (last != open.end() && place_of(features[*last]) == place) ++last;
    double squared = 0, brightest = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      const double value = pixels.rgb[3 * place + c];
      double with = value, covered = 0;
      for (auto i = first; i != last; ++i) {
        const double share = std::min(double{features[*i].share}, 1 - covered);
        with += (radiance[*i].*color_channels[c] - value) * share;
        covered += share;
      }
      squared += std::pow(display.level(with) - display.level(value), 2);
      brightest = std::max(brightest, with);
    }
    if (squared > 0)
      missed.push_back({static_cast<std::uint32_t>(place), static_cast<float>(squared * features[*first].count),
                        film_value(brightest)});
  }
  return missed;
}

SummedErrors add_rare_light(const UniformPixels& pixels, const DisplayTransform& display, std::size_t first_row,
                            std::span<float> variances, double chance_min) {
  constexpr std::size_t cell_pixels = 1024;  // few enough to be alike, enough to have hits of one in a hundred
  const std::size_t rows = variances.size() / pixels.width;
  const std::size_t cells = std::max<std::size_t>(1, variances.size() / cell_pixels);
  SummedErrors added;
  for (std::size_t i = 0; i < cells; ++i) {
    const Cell cell{i * pixels.width / cells, (i + 1) * pixels.width / cells, first_row, first_row + rows};
    if (cell.first == cell.last) continue;
    const auto each_row = [&](const auto& use) {
      for (std::size_t row = 0; row < rows; ++row)
        use(variances.subspan(row * pixels.width + cell.first, cell.last - cell.first));
    };
    double missing = 0, variance = 0;
    for (std::size_t channel = 0; channel < 3; ++channel) {
      const ChanceSpread spread = chance_spread(pixels, display, cell, channel, chance_min);
      missing += spread.squared;
      variance += spread.squared * spread.squared / spread.hits;
    }
    each_row([&](std::span<float> row) { missing -= std::accumulate(row.begin(), row.end(), 0.0); });
    if (!(missing > 0)) continue;
    // The channels of a hit are alike: their deviations add up, to at most the square root of three times the sum.
    added.add(SummedErrors{0, 3 * variance, 0});
    const auto each = static_cast<float>(missing / cell.pixels());
    each_row([&](std::span<float> row) {
      for (float& one : row) one += each;
    });
  }
  return added;
}

PixelFeatures features_of_pixels(std::span<const SubpixelFeature> features, std::span<const Color> radiance,
                                 const UniformPixels& pixels, const PixelWindow& window,
                                 const DisplayTransform& display) {
  constexpr MissedFeature unknown{.squared = 3 * 300, .brightest = std::numeric_limits<float>::infinity()};
  constexpr float beside = 0.25;  // a feature may reach into the pixels next to it
  const std::size_t width = pixels.width, height = pixels.rows();
  PixelFeatures all{std::vector<float>(width * height, -1.0F), std::vector<float>(width * height)};
  const auto raise = [&](std::size_t place, const MissedFeature& feature) {
    const std::size_t x = place % width, y = place / width;
    for (std::size_t row = y - std::min<std::size_t>(y, 1); row <= std::min(y + 1, height - 1); ++row)
      for (std::size_t at = row * width + x - std::min<std::size_t>(x, 1);
           at <= row * width + std::min(x + 1, width - 1); ++at) {
        all.squared[at] = std::max(all.squared[at], at == place ? feature.squared : beside * feature.squared);
        all.brightest[at] = std::max(all.brightest[at], feature.brightest);
      }
  };
  for (std::size_t i = 0; i < features.size(); ++i)
    raise(std::size_t{features[i].y - window.y0} * width + (features[i].x - window.x0),
          finite(radiance[i]) ? MissedFeature{} : unknown);
  for (const MissedFeature& missed : missed_features(features, radiance, pixels, window, display))
    raise(missed.place, missed);
  return all;
}

double brightest_if_needed(const CompiledScene& scene, std::span<const float> rgb) {
  const bool needed = scene.output.overflow == Output::Overflow::scale || !radiance_bound(scene);
  return needed && !rgb.empty() ? *std::ranges::max_element(rgb) : 0;
}

ErrorContext error_context(const CompiledScene& scene, std::span<const float> rgb) {
  const double brightest = brightest_if_needed(scene, rgb);
  const auto bound = radiance_bound(scene);
  return {{scene.output, brightest}, {bound.value_or(brightest), bound.has_value()}, scene.output};
}

TruncationBounds truncation_bounds(std::span<const float> omitted, const std::function<Color(std::size_t)>& value,
                                   double radiance, const DisplayTransform& display) {
  constexpr double elsewhere = 0.125;  // of the mean
  TruncationBounds bounds{.squared = std::vector<float>(omitted.size())};
  for (std::size_t place = 0; place < omitted.size(); ++place) {
    if (!(omitted[place] > 0)) continue;
    const Color mean = value(place);
    const double added = std::min(1e30, omitted[place] * radiance);
    double bound = 0;
    for (const double channel : {mean.r, mean.g, mean.b})
      bound += std::pow(display.level(channel + added) - display.level(channel), 2);
    bounds.squared[place] = static_cast<float>(bound);
    bounds.sum += bound;
    bounds.throughput += bound * omitted[place];
  }
  if (!(bounds.sum > 0)) return {};
  bounds.throughput /= bounds.sum;
  const auto least = static_cast<float>(elsewhere * bounds.sum / static_cast<double>(bounds.squared.size()));
  for (float& bound : bounds.squared) bound += least;
  bounds.sum *= 1 + elsewhere;
  return bounds;
}

ErrorEstimate measure_uniform_errors(Image& image, const UniformPixels& pixels, const OmittedError& omitted,
                                     const ErrorContext& context, const InParallel& in_parallel) {
  TileErrors tiles(pixels.width, pixels.rows());
  ErrorParts parts{.sampled = measure_samples(image, pixels, context, tiles, in_parallel), .omitted = omitted};
  if (context.output.overflow == Output::Overflow::scale) {
    BrightestRange range;
    for (std::size_t i = 0; i < pixels.rgb.size(); ++i)
      range.add(pixels.rgb[i], pixels.deviation.empty() ? 0 : pixels.deviation[i], 0, 0);
    for (const MissedFeature& missed : pixels.missed) range.high = std::max(range.high, double{missed.brightest});
    if (pixels.indirect) {  // any pixel may have missed the brightest thing that a surface can show
      const double mean =
          std::accumulate(pixels.rgb.begin(), pixels.rgb.end(), 0.0) / static_cast<double>(pixels.rgb.size());
      range.add(mean, 0, 0, missed_share(pixels.samples) * (context.bound.radiance - mean));
    }
    parts.tone = tone_error(pixels.rgb, context.output, range, in_parallel);
  }
  ErrorEstimate error = error_estimate(parts, pixels.rgb.size() / 3);
  // The other parts are taken to be the same in every tile.
  error.worst_tile = std::sqrt(std::pow(tiles.worst(), 2) + std::pow(error.estimate, 2) - std::pow(error.sampling, 2));
  return error;
}

}  // namespace tracer
