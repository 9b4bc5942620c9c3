#include "tracer/src/sampling/pixel_state.h"

#include <algorithm>
#include <bit>

namespace tracer {
namespace {

void write3(std::vector<float>& layer, std::size_t index, const Color& value) {
  if (!layer.empty()) write_color(&layer[3 * index], value);
}

template <class T>
void write1(std::vector<T>& layer, std::size_t index, T value) {
  if (!layer.empty()) layer[index] = value;
}

constexpr double Color::*channels[] = {&Color::r, &Color::g, &Color::b};

Color mean_of(const PixelState& pixel, std::size_t half) { return pixel.half[half] * (1.0 / pixel.half_count[half]); }

}  // namespace

void allocate(Image& image, const PixelWindow& window, const Output& output) {
  image.width = window.width();
  image.height = window.height();
  const std::size_t pixels = window.pixels();
  image.rgb.resize(3 * pixels);
  if (output.alpha) image.alpha.resize(pixels);
  const auto requested = [&](Layer layer) {
    return std::find(output.layers.begin(), output.layers.end(), layer) != output.layers.end();
  };
  if (requested(Layer::depth)) image.layers.depth.resize(pixels);
  if (requested(Layer::normal)) image.layers.normal.resize(3 * pixels);
  if (requested(Layer::albedo)) image.layers.albedo.resize(3 * pixels);
  if (requested(Layer::object_id)) image.layers.object_id.resize(pixels);
  if (requested(Layer::samples)) image.layers.samples.resize(pixels);
  if (requested(Layer::error)) image.layers.error.resize(pixels);
}

void PixelAccumulator::write_variance(const Color& squares, float* spread) const {
  if (count_ < 2) return;
  const double mean_share = 1.0 / count_, spread_share = 1.0 / (count_ - 1);
  const auto variance = [&](double sum, double squared) {
    return std::max(0.0, squared - sum * sum * mean_share) * spread_share;
  };
  write_color(spread, {variance(sum_.r, squares.r), variance(sum_.g, squares.g), variance(sum_.b, squares.b)});
}

void LayerAccumulator::add(const GBuffer& gbuffer, std::size_t sample) {
  ++count_;
  if (!gbuffer.hit(sample)) return;
  ++hit_count_;
  depth_ += gbuffer.depth[sample];
  normal_ += gbuffer.normal[sample];
  albedo_ += gbuffer.albedo[sample];
  if (object_id_ == 0 && gbuffer.object[sample] != GBuffer::no_object) object_id_ = gbuffer.object[sample] + 1;
}

void LayerAccumulator::write(Image& image, std::size_t index) const {
  const double share = count_ > 0 ? 1.0 / count_ : 0;
  const Vec3 normal = normal_ * share;
  Layers& layers = image.layers;
  write1(image.alpha, index, static_cast<float>(hit_count_ * share));
  const float no_hit = std::numeric_limits<float>::infinity();
  write1(layers.depth, index, hit_count_ > 0 ? film_value(depth_ / hit_count_) : no_hit);
  write3(layers.normal, index, {normal.x, normal.y, normal.z});
  write3(layers.albedo, index, albedo_ * share);
  write1(layers.object_id, index, object_id_);
  write1(layers.samples, index, count_);
}

double variance_of_one(double variance, std::uint32_t count) {
  static const std::array<double, 32> of_power = [] {
    std::array<double, 32> table{};
    for (std::size_t i = 0; i < table.size(); ++i) table[i] = std::exp2(variance_power * static_cast<double>(i));
    return table;
  }();
  if (!std::has_single_bit(count)) return variance * std::pow(static_cast<double>(count), variance_power);
  return variance * of_power[static_cast<std::size_t>(std::countr_zero(count))];
}

double refined_error(const PixelState& pixel, const DisplayTransform& display) {
  const Color first = mean_of(pixel, 0), second = mean_of(pixel, 1);
  double sum = 0;
  for (const auto channel : channels) {
    const double middle = (first.*channel + second.*channel) / 2,
                 difference = std::abs(first.*channel - second.*channel) / 2;
    const double slope = display.slope_between(middle, std::max(0.0, middle - difference));
    sum += slope * slope * difference * difference;
  }
  return sum;
}

double holdout_error(const PixelState& pixel, const DisplayTransform& display, double usual) {
  const Color first = mean_of(pixel, 0), second = mean_of(pixel, 1);
  double sum = 0;
  for (const auto channel : channels) {
    const double pilot = pixel.pilot.*channel, fresh = (first.*channel + second.*channel) / 2;
    const double slope = display.slope_between(pilot, std::max(0.0, pilot + std::copysign(usual, fresh - pilot)));
    sum += slope * slope * (pilot - first.*channel) * (pilot - second.*channel);
  }
  return sum;
}

double squared_distance(const PixelState& pixel, const DisplayTransform& display) {
  const Color mean = (mean_of(pixel, 0) + mean_of(pixel, 1)) * 0.5;
  double sum = 0;
  for (const auto channel : channels) {
    const double difference = display.level(mean.*channel) - display.level(pixel.pilot.*channel);
    sum += difference * difference;
  }
  return sum;
}

double holdout_radiance_error(const PixelState& pixel) {
  const Color first = mean_of(pixel, 0), second = mean_of(pixel, 1);
  double sum = 0;
  for (const auto channel : channels)
    sum += (pixel.pilot.*channel - first.*channel) * (pixel.pilot.*channel - second.*channel) / 3;
  return sum;
}

}  // namespace tracer
