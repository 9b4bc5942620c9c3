#include "tracer/src/plot/scale.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <initializer_list>
#include <string_view>

namespace tracer::plotting {
namespace {

constexpr double greatest = 1e300, least_positive = 1e-300;  // sums and differences stay finite

double even(double value, bool logarithmic) { return logarithmic ? std::log10(value) : value; }

int floor_exponent(double value) { return static_cast<int>(std::floor(std::log10(value))); }

std::string superscript(int number) {
  constexpr std::array<std::string_view, 10> digits{"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
  std::string text = number < 0 ? "⁻" : "";
  for (const char digit : std::to_string(std::abs(number))) text += digits[static_cast<std::size_t>(digit - '0')];
  return text;
}

bool fit(const std::vector<Tick>& labelled, const Scale& scale, const std::function<double(const std::string&)>& room) {
  for (std::size_t i = 1; i < labelled.size(); ++i) {
    const double apart = std::abs(scale.place(labelled[i].value()) - scale.place(labelled[i - 1].value()));
    if (apart < (room(labelled[i - 1].text()) + room(labelled[i].text())) / 2) return false;
  }
  return true;
}

/// Products of `digits` and every `stride`-th power of ten that lie on the scale.
std::vector<Tick> in_decades(const Scale& scale, std::initializer_list<int> digits, int stride) {
  std::vector<Tick> found;
  const int last = floor_exponent(scale.high);
  for (int exponent = floor_exponent(scale.low); exponent <= last; ++exponent) {
    if (exponent % stride != 0) continue;
    for (const int digit : digits) {
      if (const Tick tick{digit, exponent}; scale.holds(tick.value())) found.push_back(tick);
    }
  }
  return found;
}

std::vector<Tick> multiples(const Scale& scale, int factor, int exponent) {
  std::vector<Tick> found;
  const double step = Tick{factor, exponent}.value();
  const auto last = static_cast<std::int64_t>(std::floor(scale.high / step)) + 1;
  for (auto i = static_cast<std::int64_t>(std::ceil(scale.low / step)) - 1; i <= last; ++i) {
    if (const Tick tick{i * factor, exponent}; scale.holds(tick.value())) found.push_back(tick);
  }
  return found;
}

/// The finest steps whose labels fit. Terminates because one label always fits.
std::vector<Tick> linear_labels(const Scale& scale, const std::function<double(const std::string&)>& room) {
  for (int exponent = floor_exponent((scale.high - scale.low) / 100);; ++exponent) {
    for (const int factor : {1, 2, 5}) {
      auto labelled = multiples(scale, factor, exponent);
      if (fit(labelled, scale, room)) return labelled;
    }
  }
}

std::vector<Tick> logarithmic_labels(const Scale& scale, const std::function<double(const std::string&)>& room) {
  std::vector<std::vector<Tick>> candidates{in_decades(scale, {1, 2, 3, 4, 5, 6, 7, 8, 9}, 1),
                                            in_decades(scale, {1, 2, 5}, 1), in_decades(scale, {1, 3}, 1)};
  for (const int stride : {1, 2, 3, 5, 10, 20, 50, 100, 200}) candidates.push_back(in_decades(scale, {1}, stride));
  for (std::vector<Tick>& candidate : candidates) {
    if (candidate.size() >= 2 && fit(candidate, scale, room)) return std::move(candidate);
  }
  return linear_labels(scale, room);
}

}  // namespace

double Scale::place(double value) const {
  const double start = even(low, logarithmic);
  return from + (to - from) * ((even(value, logarithmic) - start) / (even(high, logarithmic) - start));
}

bool can_show(double value, bool logarithmic) {
  return std::abs(value) <= greatest && (!logarithmic || value >= least_positive);  // false for NaN
}

Scale covering(const std::vector<double>& values, bool logarithmic) {
  Scale scale{.low = logarithmic ? 0.1 : 0.0, .high = logarithmic ? 10.0 : 1.0, .logarithmic = logarithmic};
  if (values.empty()) return scale;
  const auto [least, most] = std::minmax_element(values.begin(), values.end());
  double low = even(*least, logarithmic), high = even(*most, logarithmic);
  // Extends the range of a single value, and of values that ticks of nine digits cannot distinguish.
  const double magnitude = std::max(std::abs(low), std::abs(high));
  if (high - low <= std::max(1e-9 * magnitude, least_positive)) {
    const double reach = logarithmic ? 0.5 : magnitude > 1e9 * least_positive ? magnitude / 2 : 1;
    low -= reach;
    high += reach;
  }
  const double margin = 0.05 * (high - low);
  const bool from_zero = !logarithmic && *least >= 0 && *least < *most / 2;
  scale.low = from_zero ? 0 : low - margin;
  scale.high = high + margin;
  if (logarithmic) {
    scale.low = std::pow(10.0, std::max(scale.low, -307.0));  // normal, and finite
    scale.high = std::pow(10.0, std::min(scale.high, 307.0));
  }
  return scale;
}

double Tick::value() const {
  const std::string decimal = std::to_string(digits) + "e" + std::to_string(exponent);
  double nearest = 0;
  std::from_chars(decimal.data(), decimal.data() + decimal.size(), nearest);
  return nearest;
}

std::string Tick::text() const {
  if (digits == 0) return "0";
  std::string figures = std::to_string(std::abs(digits));
  int power = exponent;  // of the last digit
  for (; figures.back() == '0'; ++power) figures.pop_back();
  const int leading = power + static_cast<int>(figures.size()) - 1;
  const std::string sign = digits < 0 ? "−" : "";
  if (leading < -3 || leading > 4) {
    const std::string ten = "10" + superscript(leading);
    if (figures == "1") return sign + ten;
    return sign + figures.substr(0, 1) + (figures.size() > 1 ? "." : "") + figures.substr(1) + "·" + ten;
  }
  if (power >= 0) return sign + figures + std::string(static_cast<std::size_t>(power), '0');
  if (leading < 0) return sign + "0." + std::string(static_cast<std::size_t>(-leading - 1), '0') + figures;
  return sign + figures.insert(static_cast<std::size_t>(leading) + 1, ".");
}

Ticks ticks(const Scale& scale, const std::function<double(const std::string&)>& room) {
  if (!scale.logarithmic) return {linear_labels(scale, room), {}};
  Ticks found{logarithmic_labels(scale, room), {}};
  const double decade = std::abs(scale.to - scale.from) / (std::log10(scale.high) - std::log10(scale.low));
  if (decade < 6) return found;  // pixels; denser lines are illegible
  for (const Tick& tick : decade < 30 ? in_decades(scale, {1}, 1) : in_decades(scale, {2, 3, 4, 5, 6, 7, 8, 9}, 1)) {
    const double value = tick.value();
    const bool labelled =
        std::ranges::any_of(found.labelled, [value](const Tick& other) { return other.value() == value; });
    if (!labelled) found.minor.push_back(value);
  }
  return found;
}

}  // namespace tracer::plotting
