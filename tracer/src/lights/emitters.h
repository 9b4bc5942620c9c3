#pragma once
/// Sampling of glowing surfaces and of a sky with textures or behind openings, as directions from a point. The sky and
/// each surface are selected by their power over the squared distance; of a sky with textures behind openings either is
/// sampled in half of the cases. Triangles and discs are sampled uniformly over their area; of any other shape the cone
/// around its bounding sphere is, which for a sphere is exactly the directions that meet it (Shirley, Wang, Zimmerman
/// 1996, "Monte Carlo Techniques for Direct Lighting Calculations"). Infinite planes are never selected.

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
  Emitters(const GeometrySet& geometry, const std::vector<float>& radiance, SkyTable sky, SkyOpenings openings);

  [[nodiscard]] bool empty() const { return emitters_.empty() && sky_.empty() && openings_.empty(); }

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

  /// Probability with which a diffuse ray from a point should search surfaces that glow and openings, beside a sample
  /// of them. It is 1 near surfaces that are large for their distance, of whose samples few count. Elsewhere it is
  /// their area over that of a disc with the distance as radius, so that a sample brings no more than their mean
  /// radiance over it.
  [[nodiscard]] double search_probability(const Vec3& from) const;

  /// The same as density() of a direction to the sky.
  [[nodiscard]] double density_of_sky(const Vec3& from, const Vec3& direction) const {
    const double of_openings = share_of_openings(from);
    double density = of_openings > 0 ? of_openings * openings_.density(from, direction) : 0;
    if (!sky_.empty()) density += (1 - of_openings) * sky_.density(direction);
    return density > 0 ? sky_share(from) * density : 0;
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
  [[nodiscard]] double sky_share(const Vec3& from) const;
  /// Probability that its openings are, if the sky is.
  [[nodiscard]] double share_of_openings(const Vec3& from) const {
    return openings_.empty() ? 0 : sky_.empty() ? 1 : openings_.contains(from) ? 0.5 : 0;
  }
  /// A direction to the sky and its density. Precondition: sky_share() is positive.
  [[nodiscard]] Sample sample_sky(const Vec3& from, Vec2 xi) const;

  const GeometrySet* geometry_ = nullptr;
  std::vector<Emitter> emitters_;  ///< ascending by primitive
  LightTree tree_;                 ///< selects emitters
  double area_ = 0;
  Bounds bounds_;
  SkyTable sky_;
  SkyOpenings openings_;
  LightTree lamp_of_openings_;
};

}  // namespace tracer
