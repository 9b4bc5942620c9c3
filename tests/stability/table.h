#pragma once
/// The table of extremes: each test counts its tries and failures, and one table of all of them is printed at the end.
/// A failure also fails its test.

#include <cstdint>
#include <string>
#include <string_view>

#include "tests/support/reference_tracer.h"
#include "tests/support/scenes.h"

namespace stability {

/// Kind of expected result of a row.
enum class Oracle {
  closed_form,   ///< MP: a formula or a second tracer in long double
  invariance,    ///< META: a change of the input that must not change the result
  conservation,  ///< PHYS: conservation of light, rays or memory
};

/// The extremes are numbered 1 to `extremes`; what holds for all of them has number 0. Tests of unit/accel have needles
/// and slivers (5) and distant spheres (8).
inline constexpr int extremes = 27, in_unit_tests[] = {5, 8};

/// One line of the table, from its construction to the end of its scope. In every line the failures must be 0. Tries
/// that no finite precision can decide (a pixel center on a silhouette) are counted separately as `undecided`, and the
/// line contains the reason and their maximum number.
class Row {
 public:
  /// `unit`: unit of the tries, in the plural: "pixels", "rays".
  Row(int number, std::string_view name, Oracle oracle, std::string_view unit);
  ~Row();
  Row(const Row&) = delete;
  Row& operator=(const Row&) = delete;

  /// One try; the first few failures print `detail`.
  void expect(bool right, std::string_view detail = {}) { count(1, right ? 0 : 1, detail); }
  void count(std::uint64_t tried, std::uint64_t wrong, std::string_view detail = {});
  void undecided(std::uint64_t count = 1) { undecided_ += count; }

  /// Reason for undecided tries, and their maximum share. Without it none are allowed.
  void bound(std::string_view reason, double largest_part);
  /// Additional note of the line.
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

/// Adds the pixels of two images, which must be equal bit for bit.
void compare(Row& row, const tracer::Image& image, const tracer::Image& expected, std::string_view detail = {});

/// Largest difference of a channel from the second tracer, and largest margin of an edge (oracle::Sample) at which a
/// pixel may differ more: it is undecided then.
struct Tolerance {
  oracle::Real absolute = 0, relative = 0, edge = 0;
};

/// Adds the pixels of the scene, which must be those of the reference tracer.
void compare_with_reference(Row& row, const tracer::Scene& scene, const Tolerance& tolerance, std::string_view detail);

/// Renders the scene. Every sample that is not finite, and every value of the image that is not finite or negative, is
/// a failure in the last line of the table.
tracer::Rendered render(const tracer::Scene& scene, std::uint32_t threads = 1);

}  // namespace stability
