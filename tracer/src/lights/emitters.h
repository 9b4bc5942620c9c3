#pragma once
/// Sampling of glowing surfaces and of a sky with textures or behind openings, as directions from a point. The sky is
/// selected in half of the cases, or always if nothing else glows; a surface is in proportion to its area times its
/// radiance. Triangles and discs are sampled uniformly over their area; of any other shape the cone around its bounding
/// sphere is, which for a sphere is exactly the directions that meet it (Shirley, Wang, Zimmerman 1996, "Monte Carlo
/// Techniques for Direct Lighting Calculations"). Infinite planes are never selected.

#include <cstdint>
#include <optional>
#include <vector>

#include "tracer/src/accel/accelerator.h"
#include "tracer/src/lights/light_tree.h"
#include "tracer/src/lights/sky_openings.h"
#include "tracer/src/lights/sky_table.h"
#include "tracer/src/math/affine.h"
#include "tracer/src/math/lanes.h"
#include "tracer/src/math/vec.h"

namespace tracer {

/// A triangle or a disc.
struct FlatShape {
  Vec3 origin, u, v;  ///< triangle: a vertex and the edges from it; disc: center and radii at right angles or conjugate
  bool disc = false;
  Vec3 normal = cross(u, v);
  double normal_length = length(normal);

  [[nodiscard]] double area() const;
  /// Coordinates along u and v of a uniformly distributed point, for `xi` uniform in [0,1)^2.
  [[nodiscard]] Vec2 coordinates(const Vec2& xi) const;
};

class Emitters {
 public:
  Emitters() = default;
  /// `radiance`: by object, any measure of what it emits; 0 if it does not glow. The geometry must outlive it. Throws
  /// std::bad_alloc.
  Emitters(const GeometrySet& geometry, const std::vector<float>& radiance, SkyTable sky);

  /// From now on samples the openings of a sky without textures, too.
  void add_openings(SkyOpenings openings) { openings_ = std::move(openings); }

  [[nodiscard]] bool empty() const { return emitters_.empty() && sky_share() == 0; }

  struct Sample {
    PrimitiveRef primitive;  ///< no hit: the sky
    Vec3 direction;          ///< unit, from the point to the primitive; may miss a primitive sampled by its cone
    double density = 0;      ///< as density(); 0 or NaN if there is no direction
  };
  /// A direction from the render-space point `from`, for `xi` uniform in [0,1)^2. Precondition: it is not empty.
  [[nodiscard]] Sample sample(const Vec3& from, const Vec2& xi) const;
  struct alignas(64) SamplePacket {
    VecLanes direction;
    double density[lanes];
    PrimitiveRef primitive[lanes];
  };
  /// The same in the lanes of `wanted`; the others are unspecified.
  void sample(const VecLanes& from, const double* x, const double* y, LaneMask wanted, SamplePacket& to) const;
  /// Density, per solid angle, with which sample() selects this primitive and the unit direction; 0 if it never does.
  [[nodiscard]] double density(const PrimitiveRef& primitive, const Vec3& from, const Vec3& direction) const;

  /// Probability with which a diffuse ray from a point should search surfaces that glow, beside a sample of them. It is
  /// 1 near surfaces that are large for their distance, of whose samples few count. Elsewhere it is their area over
  /// that of a disc with the distance as radius, so that a sample brings no more than their mean radiance over it.
  [[nodiscard]] double search_probability(const Vec3& from) const;

  /// The same as density() of a direction to the sky.
  [[nodiscard]] double density_of_sky(const Vec3& from, const Vec3& direction) const {
    if (!openings_.empty()) return sky_share() * openings_.density(from, direction);
    return sky_.empty() ? 0 : sky_share() * sky_.density(direction);
  }

  [[nodiscard]] std::uint64_t memory_bytes() const;

 private:
  struct Emitter {
    PrimitiveRef primitive;
    std::optional<FlatShape> flat;  ///< none: sampled by its cone
    double area = 0;                ///< its own or that of its bounding sphere
  };
  using Lamps = std::vector<LightTree::Lamp>;

  void add(const PrimitiveRef& primitive, double radiance, Lamps& lamps);
  [[nodiscard]] const Emitter* find(const PrimitiveRef& primitive) const;
  /// Probability that the sky is selected.
  [[nodiscard]] double sky_share() const { return sky_.empty() && openings_.empty() ? 0 : emitters_.empty() ? 1 : 0.5; }

  const GeometrySet* geometry_ = nullptr;
  std::vector<Emitter> emitters_;  ///< ascending by primitive
  LightTree tree_;                 ///< selects emitters
  double area_ = 0;
  Bounds bounds_;
  SkyTable sky_;  ///< one of the two is empty
  SkyOpenings openings_;
};

}  // namespace tracer
