#include "tracer/src/integrator/film.h"

#include <algorithm>
#include <array>
#include <limits>

#include "tracer/src/accuracy/contrast.h"

namespace tracer {

template <class Work>
void Film::each_pixel(const Work& work) const {
  const Blocks blocks(size_, width_);
  in_parallel_(blocks.count(), [&](std::uint64_t block) {
    blocks.each_pixel(block, [&](std::size_t place, std::size_t, std::size_t) { work(place); });
  });
}

Film::Film(const CompiledScene& scene, const InParallel& in_parallel)
    : scene_(scene),
      in_parallel_(in_parallel),
      width_(scene.image.window().width()),
      size_(scene.image.window().pixels()),
      rgb_(3 * size_) {
  if (scene.needs.layers) layers_.resize(size());
  if (scene.needs.reflection || scene.needs.refraction || scene.needs.many_lights) missing_.resize(size());
}

void Film::sketch(std::size_t place, std::uint32_t side, const Color& radiance,
                  const std::vector<MissingLight>& missing, const FirstHits& hits, std::size_t sample) {
  forget(place);
  note(place, missing, hits, sample);
  rgb_[3 * place] = film_value(radiance.r);
  rgb_[3 * place + 1] = film_value(radiance.g);
  rgb_[3 * place + 2] = film_value(radiance.b);
  if (side > 1) sketch_like(place, side, place);
}

void Film::sketch_like(std::size_t place, std::uint32_t side, std::size_t like) {
  const std::array<float, 3> color{rgb_[3 * like], rgb_[3 * like + 1], rgb_[3 * like + 2]};
  const std::size_t columns = std::min<std::size_t>(side, width_ - place % width_);
  for (std::size_t row = place; row < std::min(size_, place + std::size_t{side} * width_); row += width_) {
    for (std::size_t at = row; at < row + columns; ++at) {
      std::copy(color.begin(), color.end(), rgb_.begin() + static_cast<std::ptrdiff_t>(3 * at));
      if (!missing_.empty()) missing_[at] = missing_[like];
      if (!layers_.empty()) layers_[at] = layers_[like];
    }
  }
}

void Film::begin() {
  pixels_.resize(size());
  each_pixel([&](std::size_t i) { pixels_[i].pilot = {rgb_[3 * i], rgb_[3 * i + 1], rgb_[3 * i + 2]}; });
}

void Film::note(std::size_t place, const std::vector<MissingLight>& missing, const FirstHits& hits,
                std::size_t sample) {
  if (!missing_.empty()) {
    missing_[place].depth += missing[sample].depth;
    missing_[place].cutoff += missing[sample].cutoff;
    missing_[place].spared += missing[sample].spared;
  }
  if (!layers_.empty()) layers_[place].add(hits, sample);
}

void Film::forget(std::size_t place) {
  if (!missing_.empty()) missing_[place] = {};
  if (!layers_.empty()) layers_[place] = {};
}

void Film::note(std::size_t place, const Scout& scout, const Color& radiance, const Levels& levels) {
  PixelState& pixel = pixels_[place];
  double apart = 0, missed = 0;
  for (const auto channel : {&Color::r, &Color::g, &Color::b}) {
    const double pilot = pixel.pilot.*channel, there = radiance.*channel, shown = levels.level(pilot);
    const double mean = pilot + (there - pilot) * scout.share;
    apart += (levels.level(there) - shown) * (levels.level(there) - shown);
    missed += (levels.level(mean) - shown) * (levels.level(mean) - shown);
  }
  if (!(apart > 0)) return;
  pixel.hidden += static_cast<float>(apart * scout.share * (1 - scout.share));
  pixel.missed += static_cast<float>(missed);
  pixel.hidden_share = std::min(pixel.hidden_share, scout.share);
}

void Film::expect(const Levels& levels) {
  std::vector<float> shown(rgb_.size());
  each_pixel([&](std::size_t i) {
    for (std::size_t at = 3 * i; at < 3 * i + 3; ++at) shown[at] = static_cast<float>(levels.level(rgb_[at]));
  });
  const Blocks blocks(size_, width_);
  const Contrasts contrasts(shown, width_);
  in_parallel_(blocks.count(), [&](std::uint64_t block) {
    blocks.each_pixel(block, [&](std::size_t i, std::size_t x, std::size_t y) {
      PixelState& pixel = pixels_[i];
      pixel.contrast = contrasts.at(x, y);
      pixel.variance = static_cast<float>(std::max(expected_variance(pixel.contrast), pixel.unseen()));
    });
  });
}

void Film::suspect(std::size_t place, double error) {
  constexpr double caught = 16, beside = 1.0 / 4;
  if (!(error > caught * pixels_[place].variance)) return;
  const std::size_t x = place % width_, y = place / width_, rows = size_ / width_;
  for (std::size_t ny = y - std::min<std::size_t>(y, 1); ny <= std::min(y + 1, rows - 1); ++ny)
    for (std::size_t nx = x - std::min<std::size_t>(x, 1); nx <= std::min<std::size_t>(x + 1, width_ - 1); ++nx) {
      PixelState& pixel = pixels_[ny * width_ + nx];
      if (!pixel.refined()) pixel.variance = std::max(pixel.variance, static_cast<float>(error * beside));
    }
  pixels_[place].variance = static_cast<float>(error);
}

Levels Film::levels() const {
  double most = 0;
  if (scene_.output.overflow == Output::Overflow::scale)
    for (std::size_t i = 0; i < size(); ++i) most = std::max(most, max_component(mean(i)));
  return {scene_.output, most};
}

Color Film::mean(std::size_t place) const {
  if (!pixels_.empty()) return pixels_[place].mean();
  return {rgb_[3 * place], rgb_[3 * place + 1], rgb_[3 * place + 2]};
}

MissingError Film::missing_error(const Levels& levels) {
  if (missing_.empty()) return {};
  if (pixels_.empty()) return tracer::missing_error(rgb_, missing_, most_hideable(), levels);
  take_means();
  return tracer::missing_error(rgb_, missing_of_one(), most_hideable(), levels);
}

Hideable Film::most_hideable() const {
  const Hideable by_scene = hideable(scene_, 0);
  return by_scene.bounded ? by_scene : hideable(scene_, brightest(rgb_));
}

void Film::take_means() {
  if (pixels_.empty()) return;
  each_pixel([&](std::size_t i) {
    if (!pixels_[i].refined()) return;
    const Color mean = pixels_[i].mean();
    rgb_[3 * i] = film_value(mean.r);
    rgb_[3 * i + 1] = film_value(mean.g);
    rgb_[3 * i + 2] = film_value(mean.b);
  });
}

std::vector<MissingLight> Film::missing_of_one() const {
  std::vector<MissingLight> missing = missing_;
  if (missing.empty()) return missing;
  for (std::size_t i = 0; i < pixels_.size(); ++i) {
    const float share = 1.0f / static_cast<float>(pixels_[i].count());
    missing[i] = {missing_[i].depth * share, missing_[i].cutoff * share, missing_[i].spared * share};
  }
  return missing;
}

/// The pixels' variances, made to add up to what is claimed of the picture. A sketch's are all alike.
std::vector<float> Film::claimed_variances(const SampledError& sampled) const {
  if (pixels_.empty()) {
    const double each = sampled.squared_upper / static_cast<double>(size_);
    return std::vector<float>(size_, static_cast<float>(each));
  }
  std::vector<float> variances;
  variances.reserve(pixels_.size());
  double sum = 0;
  for (const PixelState& pixel : pixels_) {
    variances.push_back(pixel.variance);
    sum += pixel.variance;
  }
  const auto factor = static_cast<float>(sum > 0 ? std::max(1.0, sampled.squared_upper / sum) : 1);
  for (float& variance : variances) variance *= factor;
  return variances;
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
  statistics.audit_samples = statistics.samples - in_means;
}

void Film::write(Rendered& rendered, const SampledError& sampled, bool whole) {
  if (pixels_.empty()) {
    rendered.statistics.samples_min = whole ? 1 : 0;
    rendered.statistics.samples_max = 1;
  } else {
    count(rendered.statistics);
    take_means();
  }
  Image& image = rendered.image;
  const Levels shown = levels();
  const Hideable hidden = most_hideable();
  image.rgb = std::move(rgb_);
  allocate(image, scene_.image.window(), scene_.output);
  for (std::size_t i = 0; i < layers_.size(); ++i) layers_[i].write(image, i);
  if (image.layers.error.empty()) return;
  write_error_layer(image, claimed_variances(sampled), missing_of_one(), hidden, shown);
}

}  // namespace tracer
