#pragma once
/// Scale of an axis: positions of values, and ticks.

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace tracer::plotting {

/// Maps values from `low` to `high` linearly or logarithmically to the pixels `from` to `to` (`to` < `from` if values
/// grow upwards). Precondition: low < high, and 0 < low on a logarithmic scale.
struct Scale {
  double low = 0, high = 1;
  bool logarithmic = false;
  double from = 0, to = 1;

  [[nodiscard]] double place(double value) const;
  [[nodiscard]] bool holds(double value) const { return value >= low && value <= high; }
};

/// True if a value can be drawn on such an axis; see PlotPoint.
bool can_show(double value, bool logarithmic);

/// Scale that contains all `values`, each of which can be drawn; its pixels are not set. Without values: from 0 to 1,
/// or from 0.1 to 10.
Scale covering(const std::vector<double>& values, bool logarithmic);

/// digits x 10^exponent: exact decimal representation, for exact text.
struct Tick {
  std::int64_t digits = 0;
  int exponent = 0;

  [[nodiscard]] double value() const;
  [[nodiscard]] std::string text() const;  ///< "0.02", "1500", "3·10⁻⁷"
};

struct Ticks {
  std::vector<Tick> labelled;  ///< ascending
  std::vector<double> minor;   ///< unlabelled ticks between; logarithmic axes only
};

/// As many labelled ticks as fit. `room` returns the pixels that a label needs along the axis; the distance of two
/// labels is at least half of the sum of both. Linear axes: multiples of 1, 2 or 5 times a power of ten (Heckbert 1990,
/// "Nice numbers for graph labels", Graphics Gems, p. 61). Logarithmic axes: within decades, else every decade, else
/// every second, third ... one; like a linear axis if too few of those lie on it.
Ticks ticks(const Scale& scale, const std::function<double(const std::string&)>& room);

}  // namespace tracer::plotting
