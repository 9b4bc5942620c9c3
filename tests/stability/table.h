#pragma once
/// The table of extremes: each test of this executable counts what it tried and what came out wrong, and one table of
/// all of them is printed at the end. A count that is wrong fails the test that made it.

#include <cstdint>
#include <string>
#include <string_view>

#include "tests/support/scenes.h"

namespace stability {

/// What a row is judged by.
enum class Oracle {
  closed_form,   ///< MP: a formula or a second tracer in long double
  invariance,    ///< META: a change that must not change the answer
  conservation,  ///< PHYS: light, rays or memory that are neither lost nor made
};

/// The extremes are numbered 1 to `extremes`; what holds for all of them has number 0.
inline constexpr int extremes = 27;

/// One line of the table, from its construction to the end of its scope. In every line wrong must be 0. Tries that no
/// finite precision can decide (a pixel's centre on a silhouette) are no silent exception: they are counted apart as
/// `undecided`, and the line says why and how many there may be at most.
class Row {
 public:
  /// `unit` is what is tried, in the plural: "pixels", "rays".
  Row(int number, std::string_view name, Oracle oracle, std::string_view unit);
  ~Row();
  Row(const Row&) = delete;
  Row& operator=(const Row&) = delete;

  /// One try; the first few that are wrong tell `detail`.
  void expect(bool right, std::string_view detail = {}) { count(1, right ? 0 : 1, detail); }
  void count(std::uint64_t tried, std::uint64_t wrong, std::string_view detail = {});
  void undecided(std::uint64_t count = 1) { undecided_ += count; }

  /// Why tries may be undecided, and at most which part of them. Without it none may be.
  void bound(std::string_view reason, double largest_part);
  /// What is worth knowing beside the counts.
  void note(std::string_view text) { note_ = text; }

  [[nodiscard]] std::uint64_t tried() const { return tried_; }
  [[nodiscard]] std::uint64_t wrong() const { return wrong_; }

 private:
  int number_;
  std::string name_, unit_, reason_, note_;
  Oracle oracle_;
  std::uint64_t tried_ = 0, wrong_ = 0, undecided_ = 0;
  double largest_part_ = 0;
};

/// The scene's image. Every sample that is not finite is wrong in the table's last line, and so is every value of the
/// image that is not finite or is below 0.
tracer::Rendered render(const tracer::Scene& scene, std::uint32_t threads = 1);

}  // namespace stability
