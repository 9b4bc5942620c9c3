#include "tracer/src/sampling/pixel_sums.h"

#include <algorithm>

namespace tracer {
namespace {

void write3(std::vector<float>& layer, std::size_t index, const Color& value) {
  if (!layer.empty()) write_color(&layer[3 * index], value);
}

template <class T>
void write1(std::vector<T>& layer, std::size_t index, T value) {
  if (!layer.empty()) layer[index] = value;
}

}  // namespace

void allocate(Image& image, const PixelWindow& window, const Output& output) {
  image.width = window.width();
  image.height = window.height();
  const std::size_t pixels = window.pixels();
  image.rgb.resize(3 * pixels);
  if (output.alpha) image.alpha.resize(pixels);
  const auto requested = [&](Layer layer) { return std::ranges::find(output.layers, layer) != output.layers.end(); };
  if (requested(Layer::depth)) image.layers.depth.resize(pixels);
  if (requested(Layer::normal)) image.layers.normal.resize(3 * pixels);
  if (requested(Layer::albedo)) image.layers.albedo.resize(3 * pixels);
  if (requested(Layer::object_id)) image.layers.object_id.resize(pixels);
  if (requested(Layer::samples)) image.layers.samples.resize(pixels);
  if (requested(Layer::error)) image.layers.error.resize(pixels);
}

void PixelAccumulator::write_deviation(const PixelAccumulator& half, float* deviation) const {
  const std::uint32_t others = count_ - half.count_;
  if (half.count_ == 0 || others == 0) return;
  const double half_share = 1.0 / half.count_, other_share = 1.0 / others,
               factor = std::sqrt(static_cast<double>(half.count_) * others) / count_;
  const auto of = [&](double sum, double half_sum) {
    return std::abs(half_sum * half_share - (sum - half_sum) * other_share) * factor;
  };
  write_color(deviation, {of(sum_.r, half.sum_.r), of(sum_.g, half.sum_.g), of(sum_.b, half.sum_.b)});
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

void LayerAccumulator::add(const LayerAccumulator& later) {
  count_ += later.count_;
  hit_count_ += later.hit_count_;
  depth_ += later.depth_;
  normal_ += later.normal_;
  albedo_ += later.albedo_;
  if (object_id_ == 0) object_id_ = later.object_id_;
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

void average_halves(std::span<const Color> samples, std::uint32_t half_size, std::span<std::optional<Halves>> means) {
  auto sample = samples.begin();
  for (std::optional<Halves>& mean : means) {
    Halves halves{};
    bool measured = true;
    for (Color& half : halves) {
      std::uint32_t count = 0;
      for (std::uint32_t index = 0; index < half_size; ++index, ++sample) {
        if (!finite(*sample)) continue;  // counted by the tracer
        half += *sample;
        ++count;
      }
      measured = measured && count > 0;
      half = half * (1.0 / count);
    }
    if (measured) mean = halves;
  }
}

double fresh_error(const Color& value, const Halves& fresh, const DisplayTransform& display) {
  double error = 0;
  for (const auto channel : color_channels) {
    const double own = value.*channel, first = fresh[0].*channel, second = fresh[1].*channel;
    const double product = (own - first) * (own - second);
    if (product == 0) continue;
    const double nearer = product < 0 ? own : std::abs(own - first) < std::abs(own - second) ? first : second;
    const double slope = display.slope_between(own, nearer);
    error += slope * slope * product;
  }
  return error;
}

HalvesDistance::HalvesDistance(const Color& value, const Halves& a, const Halves& b, const DisplayTransform& display) {
  squared = noise = 0;
  for (const auto channel : color_channels) {
    const double own = value.*channel, first = a[0].*channel - b[0].*channel, second = a[1].*channel - b[1].*channel;
    const double level = display.level(own), of_first = display.level(own + first) - level,
                 of_second = display.level(own + second) - level,
                 of_mean = display.level(own + (first + second) / 2) - level;
    squared += 2 * of_mean * of_mean - (of_first * of_first + of_second * of_second) / 2;
    noise += (of_first - of_second) * (of_first - of_second) / 2;
  }
}

}  // namespace tracer
