#include "tracer/src/sampling/film.h"

#include <algorithm>

namespace tracer {
namespace {

template <class Work>
void each_place(const InParallel& in_parallel, std::size_t size, std::uint32_t width, const Work& work) {
  const Blocks blocks(size, width);
  in_parallel(blocks.count(), [&](std::uint64_t block) {
    blocks.each_pixel(block, [&](std::size_t place, std::size_t, std::size_t) { work(place); });
  });
}

}  // namespace

Film::Film(const CompiledScene& scene, const PixelWindow& window, SampleDecay decay)
    : scene_(scene),
      decay_(decay),
      width_(window.width()),
      size_(window.pixels()),
      rgb_(3 * size_),
      count_(size_),
      weight_(size_),
      error_(size_),
      signatures_(size_) {
  if (!decay.stratified) deviation_.resize(3 * size_);
  if (scene.needs.layers) layers_.resize(size_);
  if (scene.accuracy.truncates()) omitted_.resize(size_);
}

void Film::set_pilot(std::size_t place, std::uint32_t side, const Color& radiance, const SampleSignature& signature) {
  write_color(&rgb_[3 * place], radiance);
  signatures_[place] = signature;
  if (side > 1) fill_block(place, side, place);
}

void Film::fill_block(std::size_t place, std::uint32_t side, std::size_t source) {
  const std::array<float, 3> color{rgb_[3 * source], rgb_[3 * source + 1], rgb_[3 * source + 2]};
  const std::size_t columns = std::min<std::size_t>(side, width_ - place % width_);
  for (std::size_t row = place; row < std::min(size_, place + std::size_t{side} * width_); row += width_) {
    for (std::size_t at = row; at < row + columns; ++at) {
      std::copy(color.begin(), color.end(), rgb_.begin() + static_cast<std::ptrdiff_t>(3 * at));
      signatures_[at] = signatures_[source];
      if (!omitted_.empty()) omitted_[at] = omitted_[source];
      if (!layers_.empty()) layers_[at] = layers_[source];
    }
  }
}

void Film::add(std::size_t place, const SetSums& sums) {
  const std::uint32_t before = count_[place], count = sums.count[0] + sums.count[1];
  if (count == 0) return;
  const Color fresh = (sums.mean[0] * sums.count[0] + sums.mean[1] * sums.count[1]) * (1.0 / count);
  const double share = share_of(place, count);
  const bool replaces = weight_[place] == 0;
  write_color(&rgb_[3 * place], replaces ? fresh : mean(place) * (1 - share) + fresh * share);
  weight_[place] += static_cast<float>(1 / decay_.of(count));
  count_[place] = before + count + (before == 0 && !replaces ? 1 : 0);
  if (!layers_.empty()) {
    if (before == 0) layers_[place] = {};
    layers_[place].add(sums.layers);
  }
}

void Film::scale_errors(double scale) {
  for (float& error : error_)
    if (error > 0) error *= static_cast<float>(scale);
}

void Film::add_deviation(std::size_t place, double share, const Color& deviation) {
  if (deviation_.empty()) return;
  float* const all = &deviation_[3 * place];
  const auto combined = [&](float old, double fresh) { return std::hypot((1 - share) * old, share * fresh); };
  write_color(all, {combined(all[0], deviation.r), combined(all[1], deviation.g), combined(all[2], deviation.b)});
}

void Film::add_pilot_sums(std::size_t place, const std::vector<float>& omitted, const GBuffer& gbuffer,
                          std::size_t sample) {
  if (!omitted.empty()) omitted_[place] = omitted[sample];
  if (layers_.empty()) return;
  layers_[place] = {};
  layers_[place].add(gbuffer, sample);
}

void Film::write(Rendered& rendered, std::span<const float> errors, std::uint64_t pilots,
                 const InParallel& in_parallel) {
  RenderStatistics& statistics = rendered.statistics;
  const auto [least, most] = std::ranges::minmax(count_);
  statistics.samples_min = pilots == size_ ? std::max(1u, least) : 0;
  statistics.samples_max = std::max(1u, most);
  std::uint64_t in_means = 0;
  for (const std::uint32_t count : count_) in_means += std::max(1u, count);
  in_means -= size_ - pilots;
  statistics.holdout_samples = statistics.samples - std::min(statistics.samples, in_means);
  Image& image = rendered.image;
  image.rgb = std::move(rgb_);
  allocate(image, scene_.image.window(), scene_.output);
  if (!layers_.empty()) each_place(in_parallel, size_, width_, [&](std::size_t i) { layers_[i].write(image, i); });
  std::vector<float>& error = image.layers.error;
  if (error.empty()) return;
  // An upper bound for parts of the image: the squared error of some 30 pixels exceeds its expectation by up to twice.
  constexpr double margin = 2.2;
  each_place(in_parallel, size_, width_, [&](std::size_t i) { error[i] = rms_of_channels(margin * errors[i]); });
}

}  // namespace tracer
