#include "tracer/src/display/tone_mapping.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

namespace tracer {
namespace {

float float_of(double value) { return static_cast<float>(std::min<double>(value, std::numeric_limits<float>::max())); }

/// Factor that scales the largest channel value of the image to at most 1.
double scale_of(const std::vector<float>& linear, double gain) {
  double brightest = 0;
  for (const float value : linear) brightest = std::max(brightest, static_cast<double>(value));
  return brightest * gain > 1 ? 1 / brightest : gain;
}

using Code = std::array<std::uint8_t, 3>;

struct Entry {
  Code code{};
  std::uint64_t pixels = 0;
};

/// Pixels and the sums of their codes. Whole numbers, so that sums do not depend on their order.
struct Moments {
  std::uint64_t pixels = 0;
  std::array<std::uint64_t, 3> sum{};

  void add(const Entry& entry) {
    pixels += entry.pixels;
    for (std::size_t channel = 0; channel < 3; ++channel) sum[channel] += entry.pixels * entry.code[channel];
  }
  void add(const Moments& other) {
    pixels += other.pixels;
    for (std::size_t channel = 0; channel < 3; ++channel) sum[channel] += other.sum[channel];
  }
  [[nodiscard]] Moments without(const Moments& part) const {
    return {pixels - part.pixels, {sum[0] - part.sum[0], sum[1] - part.sum[1], sum[2] - part.sum[2]}};
  }
  /// |sum|^2 / pixels: the sum of squared codes less that of squared differences from the mean.
  [[nodiscard]] double explained() const {
    double squared = 0;
    for (const std::uint64_t value : sum) squared += static_cast<double>(value) * static_cast<double>(value);
    return pixels == 0 ? 0 : squared / static_cast<double>(pixels);
  }
  [[nodiscard]] Code mean() const {
    Code code{};
    for (std::size_t channel = 0; channel < 3; ++channel)
      code[channel] = static_cast<std::uint8_t>((2 * sum[channel] + pixels) / (2 * pixels));
    return code;
  }
};

/// Entries of the histogram, and the best cut of them.
struct ColorBox {
  std::span<Entry> entries;
  Moments moments{};
  std::size_t channel = 0;
  std::uint8_t last = 0;  ///< largest code of the first part
  double gain = 0;        ///< decrease of the squared error; 0: one color only
};

Code code_at(std::span<const std::uint8_t> codes, std::size_t i) { return {codes[i], codes[i + 1], codes[i + 2]}; }

/// Distinct colors in ascending order.
std::vector<Entry> histogram_of(std::span<const std::uint8_t> codes) {
  std::vector<Code> pixels;
  pixels.reserve(codes.size() / 3);
  for (std::size_t i = 0; i + 2 < codes.size(); i += 3) pixels.push_back(code_at(codes, i));
  std::ranges::sort(pixels);
  std::vector<Entry> entries;
  for (const Code& code : pixels) {
    if (entries.empty() || entries.back().code != code) entries.push_back({code, 0});
    ++entries.back().pixels;
  }
  return entries;
}

ColorBox box_of(std::span<Entry> entries) {
  ColorBox box{entries};
  std::array<std::array<Moments, 256>, 3> by_code{};
  for (const Entry& entry : entries) {
    box.moments.add(entry);
    for (std::size_t channel = 0; channel < 3; ++channel) by_code[channel][entry.code[channel]].add(entry);
  }
  const double whole = box.moments.explained();
  for (std::size_t channel = 0; channel < 3; ++channel) {
    Moments first;
    for (std::size_t code = 0; code < 255; ++code) {
      first.add(by_code[channel][code]);
      if (first.pixels == 0 || first.pixels == box.moments.pixels) continue;
      const double gain = first.explained() + box.moments.without(first).explained() - whole;
      if (!(gain > box.gain)) continue;
      box.gain = gain;
      box.channel = channel;
      box.last = static_cast<std::uint8_t>(code);
    }
  }
  return box;
}

}  // namespace

std::vector<float> straight_color(const Image& image) {
  std::vector<float> straight = image.rgb;
  for (std::size_t pixel = 0; pixel < image.alpha.size(); ++pixel) {
    for (std::size_t channel = 3 * pixel; channel < 3 * pixel + 3; ++channel) {
      const float alpha = image.alpha[pixel];
      straight[channel] = alpha > 0 ? float_of(static_cast<double>(straight[channel]) / alpha) : 0;
    }
  }
  return straight;
}

void apply_tone(std::vector<float>& linear, const Output& output) {
  using Overflow = Output::Overflow;
  double gain = std::exp2(output.exposure);
  if (output.overflow == Overflow::scale) gain = scale_of(linear, gain);
  if (gain == 1 && output.overflow != Overflow::reinhard) return;
  for (float& value : linear) {
    const double exposed = value * gain;
    value = float_of(output.overflow == Overflow::reinhard ? exposed / (1 + exposed) : exposed);
  }
}

Palette reduce_colors(std::span<std::uint8_t> codes, std::uint32_t colors) {
  std::vector<Entry> entries = histogram_of(codes);
  std::vector<ColorBox> boxes{box_of(entries)};
  while (boxes.size() < colors) {
    ColorBox& box = *std::ranges::max_element(boxes, {}, &ColorBox::gain);
    if (box.gain == 0) break;
    const auto second = std::partition(box.entries.begin(), box.entries.end(),
                                       [&](const Entry& entry) { return entry.code[box.channel] <= box.last; });
    const auto [first_part, second_part] =
        std::pair(std::span(box.entries.begin(), second), std::span(second, box.entries.end()));
    box = box_of(first_part);
    boxes.push_back(box_of(second_part));
  }
  Palette palette;
  std::vector<std::uint8_t> index_of(std::size_t{1} << 24);
  const auto place = [](const Code& code) { return std::size_t{code[0]} << 16 | std::size_t{code[1]} << 8 | code[2]; };
  for (const ColorBox& box : boxes) {
    for (const Entry& entry : box.entries)
      index_of[place(entry.code)] = static_cast<std::uint8_t>(palette.colors.size());
    palette.colors.push_back(box.moments.mean());
  }
  for (std::size_t i = 0; i + 2 < codes.size(); i += 3) {
    palette.indices.push_back(index_of[place(code_at(codes, i))]);
    const Code& color = palette.colors[palette.indices.back()];
    std::copy(color.begin(), color.end(), codes.begin() + static_cast<std::ptrdiff_t>(i));
  }
  return palette;
}

}  // namespace tracer
