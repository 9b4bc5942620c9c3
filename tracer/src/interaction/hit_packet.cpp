
#include "tracer/src/interaction/surface.h"
#include "tracer/src/shapes/shape_registry.h"

namespace tracer {
namespace {

/// From this number of lanes on, a packet costs less than single hits.
constexpr int packet_lanes_min = 3;

// Shapes of the lanes of one kind; the other lanes are undefined.
struct alignas(64) Spheres {
  VecLanes center;
  double radius[lanes];
};
struct alignas(64) Planes {
  VecLanes point, normal;
};
struct alignas(64) Vertices {
  VecLanes a, b, c;
};
struct LinearLanes {
  VecLanes x, y, z;
  [[nodiscard]] WHITTLE_INLINE Linear operator[](int i) const { return {x[i], y[i], z[i]}; }
  void set(int i, const Linear& map) {
    x.set(i, map.x);
    y.set(i, map.y);
    z.set(i, map.z);
  }
};
struct alignas(64) Quadrics {
  VecLanes origin;
  LinearLanes shape_from_render, render_from_shape;
  double kind[lanes], part[lanes];  ///< numbers: loops over doubles compare them
  double radius_0[lanes], radius_1[lanes], error[lanes];
  unsigned kinds;  ///< bits of the kinds that lanes have
};

/// Points in the quadrics' own spaces: of the rays, and of the surfaces next to them.
struct alignas(64) ShapePoints {
  VecLanes on_ray, position, normal;
};

WHITTLE_INLINE void put(const PrimitivePoint& at, int i, FacePacket& to) {
  to.position.set(i, at.position);
  to.error.set(i, at.error);
  to.face.set(i, at.across);
}

/// Normalizes the faces. Returns the lanes in which this equals normalize(); the others need its special cases.
WHITTLE_INLINE LaneMask normalize(FacePacket& to) {
  // Range of the largest component in which normalize() only divides by the length.
  constexpr double plain_min = 0x1p-300, plain_max = 0x1p300;
  LaneMask plain = 0;
  for (int i = 0; i < lanes; ++i) {
    const Vec3 across = to.face[i];
    const double x = std::abs(across.x), y = std::abs(across.y), z = std::abs(across.z);
    const double xy = x > y ? x : y, largest = xy > z ? xy : z;
    to.face.set(i, across / length(across));
    plain |= lane_bit(i, (largest > plain_min) & (largest < plain_max));
  }
  return plain;
}

// Computes all lanes. The result is valid in the lanes of the returned mask.

WHITTLE_WIDE LaneMask compute_points(const Spheres& __restrict s, const RayHitPacket& __restrict hits,
                                     FacePacket& __restrict to) {
  for (int i = 0; i < lanes; ++i) put(sphere_point(s.center[i], s.radius[i], hits.on_ray[i]), i, to);
  return all_lanes;
}

WHITTLE_WIDE LaneMask compute_points(const Planes& __restrict s, const RayHitPacket& __restrict hits,
                                     FacePacket& __restrict to) {
  for (int i = 0; i < lanes; ++i) put(plane_point(s.point[i], s.normal[i], hits.on_ray[i]), i, to);
  return all_lanes;
}

WHITTLE_WIDE LaneMask compute_points(const Vertices& __restrict s, const RayHitPacket& __restrict hits,
                                     FacePacket& __restrict to) {
  for (int i = 0; i < lanes; ++i) put(triangle_point(s.a[i], s.b[i], s.c[i], hits.u[i], hits.v[i]), i, to);
  return normalize(to);
}

/// One loop over all lanes for each kind of shape in the packet: within one loop the kinds would be branches.
template <class Standard>
WHITTLE_INLINE void compute_shape_points(const Quadrics& __restrict s, ShapePoints& __restrict p) {
  constexpr auto kind = static_cast<double>(kind_of<Standard>);
  for (int i = 0; i < lanes; ++i) {
    const bool taken = s.kind[i] == kind;
    const ShapePoint at = Standard::point(s.radius_0[i], s.radius_1[i], s.part[i], p.on_ray[i]);
    p.position.set(i, select(taken, at.position, p.position[i]));
    p.normal.set(i, select(taken, at.normal, p.normal[i]));
  }
}

WHITTLE_WIDE LaneMask compute_points(const Quadrics& __restrict s, const RayHitPacket& __restrict hits,
                                     FacePacket& __restrict to) {
  ShapePoints p{};
  for (int i = 0; i < lanes; ++i) p.on_ray.set(i, s.shape_from_render[i] * (hits.on_ray[i] - s.origin[i]));
  for_each_kind([&](auto standard) __attribute__((always_inline)) {
    using Standard = decltype(standard);
    if ((s.kinds >> static_cast<unsigned>(kind_of<Standard>) & 1) != 0) compute_shape_points<Standard>(s, p);
    return false;
  });
  for (int i = 0; i < lanes; ++i)
    put(placed({p.position[i], p.normal[i]}, s.error[i], s.origin[i], s.shape_from_render[i], s.render_from_shape[i]),
        i, to);
  return normalize(to);
}

WHITTLE_INLINE void copy_lanes(const VecLanes& __restrict from, LaneMask mask, VecLanes& __restrict to) {
  for (int i = 0; i < lanes; ++i) to.set(i, select((mask >> i & 1) != 0, from[i], to[i]));
}

WHITTLE_WIDE void copy_lanes(const FacePacket& from, LaneMask mask, FacePacket& to) {
  copy_lanes(from.position, mask, to.position);
  copy_lanes(from.error, mask, to.error);
  copy_lanes(from.face, mask, to.face);
}

/// Interpolates vertex normals in the lanes of the mask. Precondition: the faces are set.
WHITTLE_WIDE void interpolate_normals(const Vertices& __restrict at, const Vertices& __restrict normals,
                                      const RayHitPacket& __restrict hits, LaneMask mask, PointPacket& __restrict p) {
  for (int i = 0; i < lanes; ++i) {
    const double u = hits.u[i], v = hits.v[i];
    const SmoothPoint smooth = smooth_point({at.a[i], normals.a[i], 1 - u - v}, {at.b[i], normals.b[i], u},
                                            {at.c[i], normals.c[i], v}, p.position[i], p.face[i]);
    p.normal.set(i, smooth.normal);
    p.offset.set(i, smooth.shadow_offset);
  }
  for (int i = 0; i < lanes; ++i) {
    const bool flat = (mask >> i & 1) == 0;
    p.normal.set(i, select(flat, p.face[i], p.normal[i]));
    p.offset.set(i, select(flat, {}, p.offset[i]));
  }
}

/// Computes the points of one packet, by kind of shape.
class PointComputation {
 public:
  PointComputation(const GeometrySet& geometry, const RayHitPacket& hits, PointPacket& points)
      : geometry_(geometry), hits_(hits), points_(points) {}

  void run() {
    LaneMask spheres = 0, triangles = 0, quadrics = 0, planes = 0;
    const std::uint32_t first_triangles = geometry_.first_triangles(), first_quadrics = geometry_.first_quadrics();
    const std::uint32_t plane_geometry = geometry_.plane_geometry();
    for (int i = 0; i < lanes; ++i) {
      const std::uint32_t set = hits_.primitive[i].geometry;
      (set < first_triangles  ? spheres
       : set < first_quadrics ? triangles
       : set < plane_geometry ? quadrics
                              : planes) |= lane_bit(i);
    }
    points_.smooth = false;
    if (spheres != 0) sphere_points(spheres);
    if (quadrics != 0) quadric_points(quadrics);
    if (planes != 0) plane_points(planes);
    if (triangles != 0) triangle_points(triangles);  // last, since smooth lanes write all normals
  }

 private:
  void sphere_points(LaneMask mask) {
    Spheres spheres{};
    for_each_lane(mask, [&](int i) {
      const auto [set, sphere] = hits_.primitive[i];
      const SphereGeometry& from = geometry_.spheres[set];
      spheres.center.set(i, from.center(sphere));
      spheres.radius[i] = from.radius[sphere];
      points_.object[i] = from.object[sphere];
    });
    compute(mask, spheres);
  }

  void plane_points(LaneMask mask) {
    Planes planes{};
    for_each_lane(mask, [&](int i) {
      const std::uint32_t plane = hits_.primitive[i].primitive;
      planes.point.set(i, geometry_.planes.point[plane]);
      planes.normal.set(i, geometry_.planes.normal[plane]);
      points_.object[i] = geometry_.planes.object[plane];
    });
    compute(mask, planes);
  }

  void quadric_points(LaneMask mask) {
    Quadrics quadrics{};
    for_each_lane(mask, [&](int i) {
      const auto [set, primitive] = hits_.primitive[i];
      const QuadricGeometry& from = geometry_.quadric_set(set);
      const Quadric& quadric = from.quadrics[primitive];
      quadrics.origin.set(i, quadric.origin);
      quadrics.shape_from_render.set(i, quadric.shape_from_render);
      quadrics.render_from_shape.set(i, quadric.render_from_shape);
      quadrics.kind[i] = static_cast<double>(quadric.kind);
      quadrics.part[i] = hits_.u[i];
      quadrics.radius_0[i] = quadric.radius_0;
      quadrics.radius_1[i] = quadric.radius_1;
      visit_kind(quadric.kind, [&](auto standard) { quadrics.error[i] = standard.error(quadric); });
      quadrics.kinds |= 1u << static_cast<unsigned>(quadric.kind);
      points_.object[i] = from.object[primitive];
    });
    compute(mask, quadrics);
  }

  void triangle_points(LaneMask mask) {
    Vertices corners{}, normals{};
    LaneMask smooth_lanes = 0;
    for_each_lane(mask, [&](int i) {
      const auto [set, triangle] = hits_.primitive[i];
      const TriangleGeometry& mesh = geometry_.mesh(set);
      const auto& [a, b, c] = mesh.triangles[triangle];
      corners.a.set(i, mesh.position(a));
      corners.b.set(i, mesh.position(b));
      corners.c.set(i, mesh.position(c));
      points_.object[i] = mesh.object_of(triangle);
      if (mesh.normals.empty()) return;
      smooth_lanes |= lane_bit(i);
      normals.a.set(i, mesh.normal(a));
      normals.b.set(i, mesh.normal(b));
      normals.c.set(i, mesh.normal(c));
    });
    compute(mask, corners);
    if (smooth_lanes == 0) return;
    points_.smooth = true;
    interpolate_normals(corners, normals, hits_, smooth_lanes, points_);
  }

  template <class Shapes>
  void compute(LaneMask mask, const Shapes& shapes) {
    LaneMask computed = 0;
    if (mask == all_lanes) {
      computed = compute_points(shapes, hits_, points_);
    } else if (std::popcount(mask) >= packet_lanes_min) {
      FacePacket found;
      computed = compute_points(shapes, hits_, found);
      copy_lanes(found, mask, points_);
    }
    for_each_lane(mask & ~computed, [this](int i) {
      const ShapeHit at = shape_hit(geometry_, {hits_.primitive[i], 0, hits_.u[i], hits_.v[i]}, hits_.on_ray[i]);
      put({at.point.position, at.point.error, at.geometric_normal}, i, points_);
    });
  }

  const GeometrySet& geometry_;
  const RayHitPacket& hits_;
  PointPacket& points_;
};

}  // namespace

void compute_points(const GeometrySet& geometry, const RayHitPacket& hits, PointPacket& points) {
  PointComputation(geometry, hits, points).run();
}

}  // namespace tracer
