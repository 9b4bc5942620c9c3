#pragma once
/// Figures for Prometheus, in its text format 0.0.4: counters and histograms that grow while the program runs, and
/// lines for what is only known when it is asked for. Thread-safe.

#include <cstdint>
#include <map>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace telemetry {

using Labels = std::vector<std::pair<std::string_view, std::string>>;

/// A metric's name and what it tells. Units are in the name, as Prometheus wants them: _seconds, _bytes, _total.
struct Family {
  std::string_view name, help;
  std::vector<double> bounds{};  ///< upper ones of a histogram's buckets, ascending; none: a counter
};

class Metrics {
 public:
  explicit Metrics(std::vector<Family> families);

  /// `family` is the name of one of those given; a counter only grows.
  void add(std::string_view family, const Labels& labels, double amount = 1);
  void observe(std::string_view family, const Labels& labels, double value);

  /// All of them, families in the order given, with the labels that have been seen.
  [[nodiscard]] std::string text() const;

 private:
  struct Series {
    double sum = 0;
    std::vector<std::uint64_t> buckets;  ///< of a histogram, the last without a bound; not yet added up
  };
  struct Kept {
    Family family;
    std::map<std::string, Series> series;  ///< by their labels as written
  };
  Series& series(std::string_view family, const Labels& labels);

  mutable std::mutex mutex_;
  std::vector<Kept> kept_;
};

/// "# HELP" and "# TYPE".
std::string metric_head(std::string_view name, std::string_view help, std::string_view type);
std::string metric_line(std::string_view name, const Labels& labels, double value);

/// Seconds in which people and queues wait: from a hundredth to hours.
std::vector<double> waiting_seconds();

}  // namespace telemetry
