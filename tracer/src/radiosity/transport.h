#pragma once
/// Transport of light between patches as a linear system x = s + T x, one for each color, and its solution.

#include <cstdint>
#include <span>
#include <vector>

#include "tracer/control.h"
#include "tracer/src/math/vec.h"

namespace tracer {

/// Share of the value of a patch that arrives at another. A system has some hundred for each patch: they are small.
struct TransportEntry {
  std::uint32_t patch = 0;
  float r = 0, g = 0, b = 0;
  TransportEntry() = default;
  TransportEntry(std::uint32_t from, const Color& share)
      : patch(from), r(static_cast<float>(share.r)), g(static_cast<float>(share.g)), b(static_cast<float>(share.b)) {}
  [[nodiscard]] Color share() const { return {r, g, b}; }
};

/// Sorts the entries of a row by patch, and adds up those of equal patches.
void merge_entries(std::vector<TransportEntry>& entries);

class Transport {
 public:
  void reserve(std::size_t rows, std::size_t entries);
  /// Appends the row of the next patch, with what arrives there from elsewhere than patches. Throws std::bad_alloc.
  void add_row(const Color& source, std::span<const TransportEntry> entries);

  [[nodiscard]] std::size_t size() const { return sources_.size(); }
  [[nodiscard]] std::size_t entries() const { return entries_.size(); }
  [[nodiscard]] const Color& source(std::size_t patch) const { return sources_[patch]; }
  [[nodiscard]] std::span<const TransportEntry> row(std::size_t patch) const {
    const std::size_t first = patch == 0 ? 0 : row_ends_[patch - 1];
    return std::span(entries_).subspan(first, row_ends_[patch] - first);
  }

 private:
  std::vector<Color> sources_;
  std::vector<std::size_t> row_ends_;
  std::vector<TransportEntry> entries_;
};

struct TransportSolution {
  std::vector<Color> values;  ///< by patch
  std::uint32_t sweeps = 0;
  /// Upper bound of the difference from the exact solution, over all patches and channels; infinity if a row returns
  /// all the light of the patches.
  double bound = 0;
};

/// Gauss-Seidel iteration from the sources, until the bound is at most `tolerance` times the largest value or
/// `sweeps_max` is reached. With q, the largest sum of a row, the distance from the solution is at most q / (1 - q) of
/// the last change (Golub & Van Loan 2013, "Matrix Computations", sec. 11.2). Incomplete after cancellation.
TransportSolution solve(const Transport& transport, double tolerance, std::uint32_t sweeps_max, RenderControl& control);

}  // namespace tracer
