#include "tracer/src/integrator/film.h"

#include <algorithm>
#include <limits>

#include "tracer/src/accuracy/contrast.h"

namespace tracer {

Film::Film(const CompiledScene& scene)
    : scene_(scene), width_(scene.image.window().width()), pixels_(scene.image.window().pixels()) {
  if (scene.needs.layers) layers_.resize(pixels_.size());
  if (scene.needs.reflection || scene.needs.refraction || scene.needs.many_lights) missing_.resize(pixels_.size());
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

void Film::copy_notes(std::size_t to, std::size_t from) {
  if (!missing_.empty()) missing_[to] = missing_[from];
  if (!layers_.empty()) layers_[to] = layers_[from];
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
  std::vector<float> shown;
  shown.reserve(3 * pixels_.size());
  for (const PixelState& pixel : pixels_)
    for (const auto channel : {&Color::r, &Color::g, &Color::b})
      shown.push_back(static_cast<float>(levels.level(pixel.pilot.*channel)));
  const std::vector<float> contrast = contrasts(shown, width_);
  for (std::size_t i = 0; i < pixels_.size(); ++i) {
    pixels_[i].contrast = contrast[i];
    const double expected = pixels_[i].sampled ? expected_variance(contrast[i]) : contrast[i];
    pixels_[i].variance = static_cast<float>(std::max(expected, pixels_[i].unseen()));
  }
}

Levels Film::levels() const {
  double most = 0;
  for (const PixelState& pixel : pixels_) most = std::max(most, max_component(pixel.mean()));
  return {scene_.output, most};
}

std::vector<Color> Film::means() const {
  std::vector<Color> means;
  means.reserve(pixels_.size());
  for (const PixelState& pixel : pixels_) means.push_back(pixel.mean());
  return means;
}

MissingError Film::missing_error(const Levels& levels) const {
  if (missing_.empty()) return {};
  const Means means = written();
  return tracer::missing_error(means.rgb, means.missing, hideable(scene_, brightest(means.rgb)), levels);
}

Film::Means Film::written() const {
  Means means;
  means.rgb.reserve(3 * pixels_.size());
  means.missing = missing_;
  for (std::size_t i = 0; i < pixels_.size(); ++i) {
    const Color mean = pixels_[i].mean();
    for (const double channel : {mean.r, mean.g, mean.b}) means.rgb.push_back(static_cast<float>(channel));
    if (missing_.empty()) continue;
    const float share = 1.0f / static_cast<float>(pixels_[i].count());
    means.missing[i] = {missing_[i].depth * share, missing_[i].cutoff * share, missing_[i].spared * share};
  }
  return means;
}

/// The pixels' variances, made to add up to what is claimed of the picture.
std::vector<float> Film::claimed_variances(const SampledError& sampled) const {
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

void Film::write(Rendered& rendered, const SampledError& sampled) const {
  Image& image = rendered.image;
  allocate(image, scene_.image.window(), scene_.output);
  RenderStatistics& statistics = rendered.statistics;
  statistics.samples_min = std::numeric_limits<std::uint32_t>::max();
  std::uint64_t in_means = 0;
  for (std::size_t i = 0; i < pixels_.size(); ++i) {
    write_color(image, i, pixels_[i].mean());
    if (!layers_.empty()) layers_[i].write(image, i);
    const std::uint32_t samples = pixels_[i].sampled || pixels_[i].measured() ? pixels_[i].count() : 0;
    in_means += samples;
    statistics.samples_min = std::min(statistics.samples_min, samples);
    statistics.samples_max = std::max(statistics.samples_max, samples);
  }
  statistics.audit_samples = statistics.samples - in_means;
  if (image.layers.error.empty()) return;
  const Means means = written();
  write_error_layer(image, claimed_variances(sampled), means.missing, hideable(scene_, brightest(means.rgb)), levels());
}

}  // namespace tracer
