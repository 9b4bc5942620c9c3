#pragma once
/// Where a value lies on an axis, and which values get a tick.

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace tracer::plotting {

/// The values from `low` to `high`, spread evenly, or evenly by their logarithms, over the pixels `from` to `to`
/// (`to` < `from` where values grow upwards). Precondition: low < high, and 0 < low on a logarithmic one.
struct Scale {
  double low = 0, high = 1;
  bool logarithmic = false;
  double from = 0, to = 1;

  [[nodiscard]] double place(double value) const;
  [[nodiscard]] bool holds(double value) const { return value >= low && value <= high; }
};

/// Whether a value can be shown on such an axis; see PlotPoint.
bool can_show(double value, bool logarithmic);

/// The range of an axis that shows all `values`, each of which can be shown; its pixels are not set. Of no values: from
/// 0 to 1, or from 0.1 to 10.
Scale covering(const std::vector<double>& values, bool logarithmic);

/// digits x 10^exponent: a decimal number is known exactly, and so is its text.
struct Tick {
  std::int64_t digits = 0;
  int exponent = 0;

  [[nodiscard]] double value() const;
  [[nodiscard]] std::string text() const;  ///< "0.02", "1500", "3·10⁻⁷"
};

struct Ticks {
  std::vector<Tick> labelled;  ///< ascending
  std::vector<double> minor;   ///< values of the ticks between, without a label; on logarithmic axes
};

/// As many labelled ticks as there is room for. `room` says how many pixels along the axis a label wants; none comes
/// nearer to another than half of both. Linear axes: multiples of 1, 2 or 5 times a power of ten (Heckbert 1990, "Nice
/// numbers for graph labels", Graphics Gems, p. 61). Logarithmic ones: within decades, else each decade, else each
/// second, third ... one; as a linear axis where too few of those lie on it.
Ticks ticks(const Scale& scale, const std::function<double(const std::string&)>& room);

}  // namespace tracer::plotting
