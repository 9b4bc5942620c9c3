#include "tracer/src/display/tone_mapping.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <vector>

#include "tracer/src/display/srgb.h"

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

/// Entries [begin, end) of the histogram.
struct ColorBox {
  std::size_t begin = 0, end = 0;
  std::uint64_t pixels = 0;
  [[nodiscard]] std::size_t size() const { return end - begin; }
};

Code code_at(std::span<const std::uint8_t> codes, std::size_t i) { return {codes[i], codes[i + 1], codes[i + 2]}; }

/// Distinct colors in ascending order.
std::vector<Entry> histogram_of(std::span<const std::uint8_t> codes) {
  std::vector<Code> pixels;
  pixels.reserve(codes.size() / 3);
  for (std::size_t i = 0; i + 2 < codes.size(); i += 3) pixels.push_back(code_at(codes, i));
  std::sort(pixels.begin(), pixels.end());
  std::vector<Entry> entries;
  for (const Code& code : pixels) {
    if (entries.empty() || entries.back().code != code) entries.push_back({code, 0});
    ++entries.back().pixels;
  }
  return entries;
}

std::size_t longest_side(std::span<const Entry> entries) {
  std::size_t longest = 0;
  int length = -1;
  for (std::size_t channel = 0; channel < 3; ++channel) {
    const auto [low, high] =
        std::minmax_element(entries.begin(), entries.end(),
                            [channel](const Entry& a, const Entry& b) { return a.code[channel] < b.code[channel]; });
    const int extent = high->code[channel] - low->code[channel];
    if (extent > length) {
      length = extent;
      longest = channel;
    }
  }
  return longest;
}

/// Precondition: at least two entries. Both parts have at least one.
ColorBox cut(std::vector<Entry>& entries, ColorBox& box) {
  const std::span<Entry> inside(entries.data() + box.begin, box.size());
  const std::size_t channel = longest_side(inside);
  // By the channel, then by the whole color: a total order.
  std::sort(inside.begin(), inside.end(), [channel](const Entry& a, const Entry& b) {
    return a.code[channel] != b.code[channel] ? a.code[channel] < b.code[channel] : a.code < b.code;
  });
  ColorBox first{box.begin, box.begin, 0};
  while (first.end + 1 < box.end && (first.size() == 0 || 2 * (first.pixels + entries[first.end].pixels) <= box.pixels))
    first.pixels += entries[first.end++].pixels;
  const ColorBox second{first.end, box.end, box.pixels - first.pixels};
  box = first;
  return second;
}

Code mean_of(std::span<const Entry> entries) {
  Code mean{};
  for (std::size_t channel = 0; channel < 3; ++channel) {
    double sum = 0, pixels = 0;
    for (const Entry& entry : entries) {
      sum += linear_from_srgb(entry.code[channel] / 255.0) * static_cast<double>(entry.pixels);
      pixels += static_cast<double>(entry.pixels);
    }
    mean[channel] = srgb8_from_linear(static_cast<float>(sum / pixels));
  }
  return mean;
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

void reduce_colors(std::span<std::uint8_t> codes, std::uint32_t colors) {
  std::vector<Entry> entries = histogram_of(codes);
  if (entries.size() <= colors) return;
  std::vector<ColorBox> boxes{{0, entries.size(), codes.size() / 3}};
  while (boxes.size() < colors) {
    const auto fullest = std::max_element(boxes.begin(), boxes.end(), [](const ColorBox& a, const ColorBox& b) {
      return (a.size() > 1 ? a.pixels : 0) < (b.size() > 1 ? b.pixels : 0);
    });
    boxes.push_back(cut(entries, *fullest));
  }
  std::map<Code, Code> chosen;
  for (const ColorBox& box : boxes) {
    const std::span<const Entry> inside(entries.data() + box.begin, box.size());
    const Code mean = mean_of(inside);
    for (const Entry& entry : inside) chosen[entry.code] = mean;
  }
  for (std::size_t i = 0; i + 2 < codes.size(); i += 3) {
    const Code& color = chosen.at(code_at(codes, i));
    std::copy(color.begin(), color.end(), codes.begin() + static_cast<std::ptrdiff_t>(i));
  }
}

}  // namespace tracer
