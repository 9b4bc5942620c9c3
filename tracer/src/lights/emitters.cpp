#include "tracer/src/lights/emitters.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "tracer/src/math/sampling.h"
#include "tracer/src/shapes/shape_registry.h"

namespace tracer {
namespace {

constexpr double pi = std::numbers::pi;

/// None if it is neither.
std::optional<FlatShape> flat_shape(const GeometrySet& geometry, const PrimitiveRef& primitive) {
  const auto [number, i] = primitive;
  const GeometryKind kind = geometry.kind_of(number);
  if (kind == GeometryKind::triangles) {
    const TriangleGeometry& mesh = geometry.mesh(number);
    const auto& [a, b, c] = mesh.triangles[i];
    return FlatShape{mesh.position(a), mesh.position(b) - mesh.position(a), mesh.position(c) - mesh.position(a)};
  }
  if (kind != GeometryKind::quadrics) return std::nullopt;
  const Quadric& q = geometry.quadric_set(number).quadrics[i];
  if (q.kind != kind_of<UnitDisc>) return std::nullopt;
  return FlatShape{q.origin, q.render_from_shape.x, q.render_from_shape.y, true};
}

struct BoundingSphere {
  Vec3 center;
  double radius;
  [[nodiscard]] double area() const { return 4 * pi * radius * radius; }
};

/// Precondition: neither flat nor a plane.
BoundingSphere bounding_sphere(const GeometrySet& geometry, const PrimitiveRef& primitive) {
  const auto [number, i] = primitive;
  if (geometry.kind_of(number) == GeometryKind::spheres) {
    return {geometry.spheres[number].center(i), geometry.spheres[number].radius[i]};
  }
  const Quadric& q = geometry.quadric_set(number).quadrics[i];
  const Linear& m = q.render_from_shape;
  if (q.kind == kind_of<UnitSphere>) {
    // The largest stretch is at most the root of the largest row sum of the map's Gram matrix, and equal to it if the
    // columns are at right angles.
    const double xy = std::abs(dot(m.x, m.y)), yz = std::abs(dot(m.y, m.z)), zx = std::abs(dot(m.z, m.x));
    const double squared = std::max({dot(m.x, m.x) + xy + zx, dot(m.y, m.y) + xy + yz, dot(m.z, m.z) + yz + zx});
    return {q.origin, std::sqrt(squared)};
  }
  const Bounds box = local_box(q);
  const Vec3 half = (box.high - box.low) * 0.5;
  const double x = dot(m.x, m.x) * half.x * half.x, y = dot(m.y, m.y) * half.y * half.y;
  return {q.origin + m * ((box.low + box.high) * 0.5), std::sqrt(x + y + dot(m.z, m.z) * half.z * half.z)};
}

/// The cone of directions that meet a sphere: all if it contains the point.
struct DirectionCone {
  Vec3 axis;
  double height;  ///< 1 - cosine of the half angle

  DirectionCone(const BoundingSphere& sphere, const Vec3& from) {
    const Vec3 offset = sphere.center - from;
    const double squared = dot(offset, offset), sine = sphere.radius * sphere.radius / squared;
    const bool outside = sine < 1;
    axis = outside ? offset / std::sqrt(squared) : Vec3{0, 0, 1};
    height = outside ? sine / (1 + std::sqrt(1 - sine)) : 2;
  }
  [[nodiscard]] double density() const { return 1 / (2 * pi * height); }
  [[nodiscard]] Vec3 direction(const Vec2& xi) const {
    const double below = xi.x * height, across = std::sqrt(below * (2 - below));
    const Axes axes = axes_about(axis);
    const Vec2 at = point_of_circle(xi.y);
    return axis * (1 - below) + (axes.e0 * at.x + axes.e1 * at.y) * across;
  }
};

Bounds bounds_of(const FlatShape& flat) {
  Bounds bounds;
  for (const Vec3& corner : {flat.origin, flat.origin + flat.u, flat.origin + flat.v}) bounds.include(corner);
  for (const Vec3& corner : {flat.origin - flat.u, flat.origin - flat.v})
    if (flat.disc) bounds.include(corner);
  return bounds;
}

Bounds bounds_of(const BoundingSphere& sphere) {
  Bounds bounds;
  bounds.include(sphere.center, {sphere.radius, sphere.radius, sphere.radius});
  return bounds;
}

/// Flat shapes and points on them.
struct alignas(64) FlatPacket {
  VecLanes origin, u, v, normal;
  double normal_length[lanes], share[lanes], at_u[lanes], at_v[lanes];
};

WHITTLE_WIDE void aim_at_flat(const FlatPacket& __restrict flat, const VecLanes& __restrict from,
                              Emitters::SamplePacket& __restrict to) {
  for (int i = 0; i < lanes; ++i) {
    const Vec3 offset = flat.origin[i] + flat.u[i] * flat.at_u[i] + flat.v[i] * flat.at_v[i] - from[i];
    const double squared = dot(offset, offset), distance = std::sqrt(squared);
    to.direction.set(i, offset / distance);
    to.density[i] = flat.share[i] * squared * distance * flat.normal_length[i] / std::abs(dot(flat.normal[i], offset));
  }
}

}  // namespace

double FlatShape::area() const { return normal_length * (disc ? pi : 0.5); }

Vec2 FlatShape::coordinates(const Vec2& xi) const {
  const double root = std::sqrt(xi.x);
  if (!disc) return {root * (1 - xi.y), root * xi.y};
  const Vec2 at = point_of_circle(xi.y);
  return {root * at.x, root * at.y};
}

Emitters::Emitters(const GeometrySet& geometry, const std::vector<float>& radiance, SkyTable sky, SkyOpenings openings)
    : geometry_(&geometry), sky_(std::move(sky)), openings_(std::move(openings)) {
  Lamps lamps;
  for (std::uint32_t number = 0; number < geometry.plane_geometry(); ++number)
    for (std::uint32_t i = 0; i < geometry.primitive_count(number); ++i) {
      const double of_primitive = radiance[geometry.object_of({number, i})];
      if (of_primitive > 0) add({number, i}, of_primitive, lamps);
    }
  tree_ = LightTree(lamps);
  if (openings_.empty()) return;
  lamp_of_openings_ = LightTree(std::span(&openings_.lamp(), 1));
  area_ += openings_.area();
  bounds_.include(openings_.lamp().bounds);
}

void Emitters::add(const PrimitiveRef& primitive, double radiance, Lamps& lamps) {
  Emitter emitter{primitive, flat_shape(*geometry_, primitive)};
  Bounds bounds;
  if (emitter.flat) {
    bounds = bounds_of(*emitter.flat);
    emitter.area = emitter.flat->area();
  } else {
    const BoundingSphere sphere = bounding_sphere(*geometry_, primitive);
    bounds = bounds_of(sphere);
    emitter.area = sphere.area();
  }
  if (!(radiance * emitter.area > 0)) return;
  area_ += emitter.area;
  bounds_.include(bounds);
  emitters_.push_back(emitter);
  lamps.push_back({bounds, radiance * emitter.area});
}

/// Null if it does not glow.
const Emitters::Emitter* Emitters::find(const PrimitiveRef& primitive) const {
  const auto key = [](const PrimitiveRef& one) { return std::pair(one.geometry, one.primitive); };
  const auto found = std::ranges::lower_bound(emitters_, key(primitive), {},
                                              [&](const Emitter& emitter) { return key(emitter.primitive); });
  return found != emitters_.end() && found->primitive == primitive ? &*found : nullptr;
}

Emitters::Sample Emitters::sample(const Vec3& from, const Vec2& xi) const {
  VecLanes origin = {};
  origin.set(0, from);
  SamplePacket found;
  sample(origin, &xi.x, &xi.y, 1, found);
  return {found.primitive[0], found.direction[0], found.density[0]};
}

void Emitters::sample(const VecLanes& from, const double* x, const double* y, LaneMask wanted, SamplePacket& to) const {
  FlatPacket flat = {};
  LaneMask other = 0;
  double sky_share[lanes];
  Selected selected[lanes];
  for_each_lane(wanted, [&](int i) {
    other |= lane_bit(i);
    sky_share[i] = this->sky_share(from[i]);
    if (x[i] < sky_share[i]) return;
    // The position of the number among those that select the emitter is uniform: it serves twice.
    selected[i] = tree_.select(from[i], (x[i] - sky_share[i]) / (1 - sky_share[i]));
    const Emitter& emitter = emitters_[selected[i].index];
    to.primitive[i] = emitter.primitive;
    if (!emitter.flat) return;
    other &= ~lane_bit(i);
    flat.origin.set(i, emitter.flat->origin);
    flat.u.set(i, emitter.flat->u);
    flat.v.set(i, emitter.flat->v);
    flat.normal.set(i, emitter.flat->normal);
    flat.normal_length[i] = emitter.flat->normal_length;
    flat.share[i] = (1 - sky_share[i]) * selected[i].probability / emitter.area;
    const Vec2 at = emitter.flat->coordinates({selected[i].position, y[i]});
    flat.at_u[i] = at.x;
    flat.at_v[i] = at.y;
  });
  if (other != wanted) aim_at_flat(flat, from, to);
  for_each_lane(other, [&](int i) {
    if (x[i] < sky_share[i]) {
      const Sample sky = sample_sky(from[i], {x[i] / sky_share[i], y[i]});
      to.primitive[i] = {};
      to.direction.set(i, sky.direction);
      to.density[i] = sky_share[i] * sky.density;
      return;
    }
    const BoundingSphere sphere = bounding_sphere(*geometry_, to.primitive[i]);
    const DirectionCone cone(sphere, from[i]);
    to.direction.set(i, cone.direction({selected[i].position, y[i]}));
    to.density[i] = (1 - sky_share[i]) * selected[i].probability * cone.density();
  });
}

double Emitters::sky_share(const Vec3& from) const {
  if (sky_.empty() && openings_.empty()) return 0;
  if (emitters_.empty()) return 1;
  const double of_openings = share_of_openings(from);
  if (sky_.empty() && !openings_.contains(from)) return 0;
  return share_of(of_openings > 0 ? lamp_of_openings_.irradiance(from) : sky_.irradiance(), tree_.irradiance(from));
}

Emitters::Sample Emitters::sample_sky(const Vec3& from, Vec2 xi) const {
  const double of_openings = share_of_openings(from);
  const bool in_opening = xi.x < of_openings;
  xi.x = in_opening ? xi.x / of_openings : (xi.x - of_openings) / (1 - of_openings);
  const auto mixed = [&](const auto& sample) -> Sample {
    if (!(of_openings > 0 && of_openings < 1)) return {{}, sample.direction, sample.density};
    const double other = in_opening ? sky_.density(sample.direction) : openings_.density(from, sample.direction);
    return {{}, sample.direction, (sample.density + other) / 2};
  };
  return in_opening ? mixed(openings_.sample(from, xi)) : mixed(sky_.sample(xi));
}

double Emitters::density(const PrimitiveRef& primitive, const Vec3& from, const Vec3& direction) const {
  const Emitter* const emitter = find(primitive);
  if (emitter == nullptr) return 0;
  const double share =
      (1 - sky_share(from)) * tree_.probability(from, static_cast<std::size_t>(emitter - emitters_.data()));
  if (const auto& flat = emitter->flat) {
    const double rate = dot(flat->normal, direction), distance = dot(flat->normal, flat->origin - from) / rate;
    return share / emitter->area * distance * distance * flat->normal_length / std::abs(rate);
  }
  return share * DirectionCone(bounding_sphere(*geometry_, primitive), from).density();
}

double Emitters::search_probability(const Vec3& from) const {
  if (!(area_ > 0)) return 0;
  const auto beyond = [](double x, double low, double high) { return std::max({low - x, x - high, 0.0}); };
  const Vec3 apart{beyond(from.x, bounds_.low.x, bounds_.high.x), beyond(from.y, bounds_.low.y, bounds_.high.y),
                   beyond(from.z, bounds_.low.z, bounds_.high.z)};
  const double disc = pi * dot(apart, apart);
  return area_ < disc ? area_ / disc : 1;
}

std::uint64_t Emitters::memory_bytes() const {
  return emitters_.capacity() * sizeof(Emitter) + tree_.memory_bytes() + sky_.memory_bytes() + openings_.memory_bytes();
}

}  // namespace tracer
