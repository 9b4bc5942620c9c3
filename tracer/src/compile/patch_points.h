#pragma once
/// Points at which light arrives on surfaces. They lie on random lines, so that they are uniform over the area of all
/// surfaces, whatever their shapes (Sbert 1993, "An Integral Geometry Based Method for Fast Form-Factor Computation").

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "tracer/src/compiled/compiled_scene.h"
#include "tracer/src/interaction/surface.h"

namespace tracer {

/// A place on a surface, on the side that light arrives at.
struct PatchPoint {
  BoundedPoint point;
  Vec3 normal, outward;  ///< shading and geometric normal
  std::uint32_t object = 0;
  PrimitiveRef primitive;  ///< rays that start here do not hit it
};

/// Sphere in which the surfaces are divided.
struct Region {
  Vec3 center;
  double radius = 0;
};

/// Direction around a unit normal, distributed as the cosine to it, for `xi` uniform in [0,1)^2.
Vec3 diffuse_direction(const Vec3& normal, const Vec2& xi);

/// Number of a side of an object.
inline std::size_t side_of(std::uint32_t object, bool back) { return 2 * std::size_t{object} + (back ? 1 : 0); }

class PatchPoints {
 public:
  /// Finds by some lines and by random paths of light, which sides of objects light never reaches. Throws
  /// std::bad_alloc. Incomplete after cancellation.
  PatchPoints(const CompiledScene& scene, const Region& region, RenderControl& control);

  [[nodiscard]] const Region& region() const { return region_; }
  /// Points per line, in the mean: the area of the lit sides over 4 pi r^2 (Crofton's formula, for one of two sides).
  [[nodiscard]] double per_line() const { return per_line_; }

  /// Points of surfaces that reflect diffusely, on `lines` lines. Left out are those behind a dark side, as on a floor
  /// under a block that stands on it, and those within `gap` of another surface: they would darken the visible part of
  /// their patch. Lines of other streams are independent.
  [[nodiscard]] std::vector<PatchPoint> on_lines(std::uint32_t lines, double gap, std::uint64_t stream = 0) const;
  /// The same on as many lines as bring about so many points, or on 2^22. Precondition: per_line() is positive.
  [[nodiscard]] std::vector<PatchPoint> points(double count, double gap, std::uint64_t stream = 0) const {
    return on_lines(static_cast<std::uint32_t>(std::min(std::ceil(count / per_line_), 0x1p22)), gap, stream);
  }

 private:
  struct LineHit {
    PatchPoint at;
    std::uint32_t line = 0;
    bool back = false, receives = false;
  };
  struct Walker {
    Vec3 origin, direction;
    PrimitiveRef from;
  };

  /// The results of select(hits) for the hits on some lines at a time, which are not all kept.
  template <class T, class Select>
  [[nodiscard]] std::vector<T> from_lines(std::uint32_t lines, std::uint64_t stream, const Select& select) const;
  /// First rays of paths of light, from lights, from what glows and from outside.
  [[nodiscard]] std::vector<Walker> light_sources(const std::vector<LineHit>& hits);
  /// The same from places that emitters light: small ones are on no line.
  void add_light_of_emitters(const std::vector<LineHit>& hits, std::vector<Walker>& walkers);
  [[nodiscard]] Walker diffuse_walker(const PatchPoint& at, std::uint32_t number) const;
  void find_dark_sides(const std::vector<LineHit>& hits);
  /// Extends the paths by one surface each, and marks its side as lit. Returns true if one was dark.
  bool extend(std::vector<Walker>& walkers, std::uint64_t key);
  [[nodiscard]] std::vector<PatchPoint> lit(const std::vector<LineHit>& hits, double gap) const;

  const CompiledScene& scene_;
  const Region region_;
  RenderControl& control_;
  std::vector<std::uint8_t> dark_;  ///< by side
  double per_line_ = 0;
};

}  // namespace tracer
