#include "server/telemetry/metric_registry.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <charconv>
#include <cmath>

namespace telemetry {
namespace {

std::string text_of(double value) {
  if (std::isinf(value)) return value > 0 ? "+Inf" : "-Inf";
  if (std::isnan(value)) return "NaN";
  std::array<char, 32> text{};
  const auto result = std::to_chars(text.data(), text.data() + text.size(), value);
  return {text.data(), result.ptr};
}

/// `a="1",b="2"`; backslash, quote and line end are escaped.
std::string written(const Labels& labels) {
  std::string text;
  for (const auto& [name, value] : labels) {
    text.append(text.empty() ? "" : ",").append(name).append("=\"");
    for (const char c : value) {
      if (c == '\\' || c == '"') text += '\\';
      text += c == '\n' ? std::string("\\n") : std::string(1, c);
    }
    text += '"';
  }
  return text;
}

std::string line(std::string_view name, std::string_view suffix, const std::string& labels, double value) {
  std::string text(name);
  text.append(suffix);
  if (!labels.empty()) text.append("{").append(labels).append("}");
  return text.append(" ").append(text_of(value)).append("\n");
}

}  // namespace

Metrics::Metrics(std::vector<Family> families) {
  for (Family& family : families) kept_.push_back({std::move(family), {}});
}

Metrics::Series& Metrics::series(std::string_view family, const Labels& labels) {
  const auto found =
      std::find_if(kept_.begin(), kept_.end(), [&](const Kept& kept) { return kept.family.name == family; });
  assert(found != kept_.end());
  return found->series[written(labels)];
}

void Metrics::add(std::string_view family, const Labels& labels, double amount) {
  assert(amount >= 0);
  const std::lock_guard lock(mutex_);
  series(family, labels).sum += amount;
}

void Metrics::observe(std::string_view family, const Labels& labels, double value) {
  const std::lock_guard lock(mutex_);
  Series& seen = series(family, labels);
  const auto found =
      std::find_if(kept_.begin(), kept_.end(), [&](const Kept& kept) { return kept.family.name == family; });
  const std::vector<double>& bounds = found->family.bounds;
  if (seen.buckets.empty()) seen.buckets.resize(bounds.size() + 1);
  const auto bucket = std::lower_bound(bounds.begin(), bounds.end(), value) - bounds.begin();
  ++seen.buckets[static_cast<std::size_t>(bucket)];
  seen.sum += value;
}

std::string Metrics::text() const {
  const std::lock_guard lock(mutex_);
  std::string text;
  for (const Kept& kept : kept_) {
    const auto& [name, help, bounds] = kept.family;
    text += metric_head(name, help, bounds.empty() ? "counter" : "histogram");
    for (const auto& [labels, series] : kept.series) {
      if (bounds.empty()) {
        text += line(name, "", labels, series.sum);
        continue;
      }
      std::uint64_t count = 0;
      for (std::size_t i = 0; i < series.buckets.size(); ++i) {
        count += series.buckets[i];
        std::string bucket = labels;
        bucket.append(labels.empty() ? "" : ",").append("le=\"");
        bucket.append(i < bounds.size() ? text_of(bounds[i]) : "+Inf").append("\"");
        text += line(name, "_bucket", bucket, static_cast<double>(count));
      }
      text += line(name, "_sum", labels, series.sum);
      text += line(name, "_count", labels, static_cast<double>(count));
    }
  }
  return text;
}

std::string metric_head(std::string_view name, std::string_view help, std::string_view type) {
  std::string text = "# HELP ";
  text.append(name).append(" ").append(help).append("\n# TYPE ").append(name).append(" ").append(type).append("\n");
  return text;
}

std::string metric_line(std::string_view name, const Labels& labels, double value) {
  return line(name, "", written(labels), value);
}

std::vector<double> waiting_seconds() { return {0.01, 0.03, 0.1, 0.3, 1, 3, 10, 30, 60, 300, 900, 3600, 14400}; }

}  // namespace telemetry
