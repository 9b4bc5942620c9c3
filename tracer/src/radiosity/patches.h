#pragma once
/// Patches: the parts of surfaces that lie in one cell of a grid and face about the same way. They need no parameters
/// of the surfaces, so that every shape has them. A cell extends over two axes of space, those across which the surface
/// faces, and twice as far along the third, so that flat surfaces at any place are cut into squares or parallelograms.

#include <array>
#include <cmath>
#include <cstdint>
#include <unordered_map>
#include <vector>

#include "tracer/compile.h"
#include "tracer/src/lights/sky_openings.h"
#include "tracer/src/math/sampling.h"
#include "tracer/src/math/vec.h"

namespace tracer {

class PatchGrid {
 public:
  static constexpr std::uint32_t none = 0xffffffffu;

  PatchGrid() = default;
  /// `side`: of the cells, in render space.
  explicit PatchGrid(double side) : side_(side) { patches_.max_load_factor(0.5F); }  // found in fewer steps

  /// Patch of a place on an object, with the unit normal of the side that light arrives at. The number of a new patch
  /// is their count before; `none` if that is `patches_max`. Throws std::bad_alloc.
  std::uint32_t insert(std::uint32_t object, const Vec3& position, const Vec3& normal,
                       std::uint32_t patches_max = none) {
    const std::uint64_t hash = key(object, position, normal);
    if (patches_.size() >= patches_max) return find(hash);
    return patches_.emplace(hash, static_cast<std::uint32_t>(patches_.size())).first->second;
  }

  /// Patch of a place up to half a cell beside this one in the tangent plane, with a normal that is turned a little, by
  /// `xi` uniform in [0,1)^2, so that values change gradually: in the mean they are interpolated, also where surfaces
  /// curve. Where none is, at borders, that of this place or of the one on the other side of it.
  [[nodiscard]] std::uint32_t find(std::uint32_t object, const Vec3& position, const Vec3& normal,
                                   const Vec2& xi) const {
    const Vec3 beside = moved(position, normal, xi.x - 0.5, xi.y - 0.5);
    // Further digits of the numbers turn it by up to a tenth in each direction: larger turns interpolate no better.
    const auto digits = [](double x) { return 0.2 * (x - std::floor(x) - 0.5); };
    const Vec3 turn{digits(1024 * xi.x), digits(1024 * xi.y), digits(1024 * (xi.x + xi.y))};
    for (const Vec3& turned : {normal + turn, normal, normal - turn})
      if (const std::uint32_t patch = find(key(object, beside, turned)); patch != none) return patch;
    for (const Vec3& at : {position, moved(position, normal, 0.5 - xi.x, 0.5 - xi.y)})
      if (const std::uint32_t patch = find(key(object, at, normal)); patch != none) return patch;
    return none;
  }

  /// Patch of a place so many cells beside this one in the tangent plane; `none` where none is.
  [[nodiscard]] std::uint32_t beside(std::uint32_t object, const Vec3& position, const Vec3& normal, int cells_a,
                                     int cells_b) const {
    return find(key(object, moved(position, normal, cells_a, cells_b), normal));
  }

  [[nodiscard]] std::size_t size() const { return patches_.size(); }
  [[nodiscard]] double side() const { return side_; }
  [[nodiscard]] std::uint64_t memory_bytes() const {
    return patches_.bucket_count() * sizeof(void*) + patches_.size() * 4 * sizeof(std::uint64_t);
  }

 private:
  static std::size_t index(int axis) { return static_cast<std::size_t>(axis); }
  static std::array<double, 3> array(const Vec3& v) { return {v.x, v.y, v.z}; }

  static int dominant_axis(const Vec3& n) {
    const double x = std::abs(n.x), y = std::abs(n.y), z = std::abs(n.z);
    return x >= y && x >= z ? 0 : y >= z ? 1 : 2;
  }

  /// The position moved in the tangent plane by so many cells along its axes.
  [[nodiscard]] Vec3 moved(const Vec3& position, const Vec3& normal, double cells_a, double cells_b) const {
    const int axis = dominant_axis(normal), a = (axis + 1) % 3, b = (axis + 2) % 3;
    std::array<double, 3> p = array(position);
    const std::array<double, 3> n = array(normal);
    const double along_a = cells_a * side_, along_b = cells_b * side_;
    p[index(a)] += along_a;
    p[index(b)] += along_b;
    p[index(axis)] -= (n[index(a)] * along_a + n[index(b)] * along_b) / n[index(axis)];
    return {p[0], p[1], p[2]};
  }

  /// Hash of the object, the cell and the direction. Equal hashes of two patches are less likely than 1 in 2^32 for as
  /// many patches as there may be.
  [[nodiscard]] std::uint64_t key(std::uint32_t object, const Vec3& position, const Vec3& normal) const {
    const int axis = dominant_axis(normal), a = (axis + 1) % 3, b = (axis + 2) % 3;
    const std::array<double, 3> p = array(position), n = array(normal);
    const double height = n[index(axis)];
    // There are three parts: surfaces along the axes have the middle of one.
    const auto part = [&](int other) { return std::floor((n[index(other)] / std::abs(height) + 1) * 1.5); };
    const auto cell = [&](int other, double side) { return std::floor(p[index(other)] / side + 0.37); };
    std::uint64_t hash = mix(std::uint64_t{object} * 6 + static_cast<std::uint64_t>(2 * axis + (height < 0 ? 1 : 0)));
    for (const double value : {part(a), part(b), cell(a, side_), cell(b, side_), cell(axis, 2 * side_)})
      hash = mix(hash ^ static_cast<std::uint64_t>(static_cast<std::int64_t>(value)));
    return hash;
  }

  [[nodiscard]] std::uint32_t find(std::uint64_t hash) const {
    const auto found = patches_.find(hash);
    return found == patches_.end() ? none : found->second;
  }

  double side_ = 1;
  std::unordered_map<std::uint64_t, std::uint32_t> patches_;
};

/// Patches, and the mean H of what arrives at each by way of surfaces and from the background: without the light of
/// lights and of the emitters that are sampled, which is found exactly.
struct Radiosity {
  PatchGrid patches;
  std::vector<Color> arriving;                         ///< by patch
  std::array<std::vector<Color>, 2> by_half_the_rays;  ///< two independent solutions, of which this is the mean
  SkyOpenings openings;                                ///< through them the sky is sampled, too
  RadiosityFigures figures;                            ///< in the cache of stages, rays of this stage alone
  [[nodiscard]] std::uint64_t memory_bytes() const {
    return patches.memory_bytes() + openings.memory_bytes() + 3 * arriving.capacity() * sizeof(Color);
  }
};

}  // namespace tracer
