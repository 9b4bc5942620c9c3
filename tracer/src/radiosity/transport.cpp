#include "tracer/src/radiosity/transport.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace tracer {
namespace {

double largest_row(const Transport& transport) {
  double largest = 0;
  for (std::size_t patch = 0; patch < transport.size(); ++patch) {
    Color sum{};
    for (const TransportEntry& entry : transport.row(patch)) sum += entry.share();
    largest = std::max(largest, max_component(sum));
  }
  return largest;
}

double largest_change(const Color& a, const Color& b) {
  return std::max({std::abs(a.r - b.r), std::abs(a.g - b.g), std::abs(a.b - b.b)});
}

}  // namespace

void merge_entries(std::vector<TransportEntry>& entries) {
  std::stable_sort(entries.begin(), entries.end(),
                   [](const TransportEntry& a, const TransportEntry& b) { return a.patch < b.patch; });
  std::size_t kept = 0;
  for (const TransportEntry& entry : entries) {
    if (kept > 0 && entries[kept - 1].patch == entry.patch) {
      entries[kept - 1] = {entry.patch, entries[kept - 1].share() + entry.share()};
    } else {
      entries[kept++] = entry;
    }
  }
  entries.resize(kept);
}

void Transport::reserve(std::size_t rows, std::size_t entries) {
  sources_.reserve(rows);
  row_ends_.reserve(rows);
  entries_.reserve(entries);
}

void Transport::add_row(const Color& source, std::span<const TransportEntry> entries) {
  entries_.insert(entries_.end(), entries.begin(), entries.end());
  sources_.push_back(source);
  row_ends_.push_back(entries_.size());
}

TransportSolution solve(const Transport& transport, double tolerance, std::uint32_t sweeps_max,
                        RenderControl& control) {
  constexpr double typical_sweeps = 10;  // beyond them progress gets slower
  TransportSolution solution;
  solution.bound = std::numeric_limits<double>::infinity();
  for (std::size_t patch = 0; patch < transport.size(); ++patch) solution.values.push_back(transport.source(patch));
  const double q = largest_row(transport);
  while (solution.sweeps < sweeps_max && !control.cancelled()) {
    double change = 0, largest = 0;
    for (std::size_t patch = 0; patch < transport.size(); ++patch) {
      Color value = transport.source(patch);
      for (const TransportEntry& entry : transport.row(patch)) value += solution.values[entry.patch] * entry.share();
      change = std::max(change, largest_change(value, solution.values[patch]));
      largest = std::max(largest, max_component(value));
      solution.values[patch] = value;
    }
    ++solution.sweeps;
    control.reach_in_build_step(solution.sweeps / (solution.sweeps + typical_sweeps));
    if (q < 1) solution.bound = q / (1 - q) * change;
    if (solution.bound <= tolerance * largest || change == 0) break;
  }
  return solution;
}

}  // namespace tracer
