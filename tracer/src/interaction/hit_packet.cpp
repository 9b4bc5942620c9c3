#include "tracer/src/interaction/hit_packet.h"

#include "tracer/src/interaction/quadric_hits.h"
#include "tracer/src/interaction/surface.h"

namespace tracer {
namespace {

/// From this number of lanes on, a packet costs less than single hits.
constexpr int packet_lanes_min = 3;

// Shapes of the lanes of one kind; the other lanes are undefined.
struct alignas(64) Spheres {
  double x[lanes], y[lanes], z[lanes], radius[lanes];
};
struct alignas(64) Planes {
  double x[lanes], y[lanes], z[lanes];
  double normal_x[lanes], normal_y[lanes], normal_z[lanes];
};
struct alignas(64) Vertices {
  double ax[lanes], ay[lanes], az[lanes];
  double bx[lanes], by[lanes], bz[lanes];
  double cx[lanes], cy[lanes], cz[lanes];
};
WHITTLE_WIDE LaneMask compute_points(const Spheres& __restrict s, const RayHitPacket& __restrict hits,
                                     FacePacket& __restrict to) {
  for (int i = 0; i < lanes; ++i)
    put(sphere_point({s.x[i], s.y[i], s.z[i]}, s.radius[i], {hits.on_x[i], hits.on_y[i], hits.on_z[i]}), i, to);
  return all_lanes;
}

WHITTLE_WIDE LaneMask compute_points(const Planes& __restrict s, const RayHitPacket& __restrict hits,
                                     FacePacket& __restrict to) {
  for (int i = 0; i < lanes; ++i)
    put(plane_point({s.x[i], s.y[i], s.z[i]}, {s.normal_x[i], s.normal_y[i], s.normal_z[i]},
                    {hits.on_x[i], hits.on_y[i], hits.on_z[i]}),
        i, to);
  return all_lanes;
}

WHITTLE_WIDE LaneMask compute_points(const Vertices& __restrict s, const RayHitPacket& __restrict hits,
                                     FacePacket& __restrict to) {
  for (int i = 0; i < lanes; ++i)
    put(triangle_point({s.ax[i], s.ay[i], s.az[i]}, {s.bx[i], s.by[i], s.bz[i]}, {s.cx[i], s.cy[i], s.cz[i]}, hits.u[i],
                       hits.v[i]),
        i, to);
  return normalize(to);
}

WHITTLE_INLINE void select(const double* __restrict found, LaneMask mask, double* __restrict to) {
  for (int i = 0; i < lanes; ++i) to[i] = (mask >> i & 1) != 0 ? found[i] : to[i];
}

WHITTLE_WIDE void copy_lanes(const FacePacket& found, LaneMask mask, FacePacket& p) {
  select(found.x, mask, p.x);
  select(found.y, mask, p.y);
  select(found.z, mask, p.z);
  select(found.error_x, mask, p.error_x);
  select(found.error_y, mask, p.error_y);
  select(found.error_z, mask, p.error_z);
  select(found.face_x, mask, p.face_x);
  select(found.face_y, mask, p.face_y);
  select(found.face_z, mask, p.face_z);
}

/// Interpolates vertex normals in the lanes of the mask. Precondition: the faces are set.
WHITTLE_WIDE void smooth(const Vertices& __restrict at, const Vertices& __restrict normals,
                         const RayHitPacket& __restrict hits, LaneMask mask, PointPacket& __restrict p) {
  for (int i = 0; i < lanes; ++i) {
    const double u = hits.u[i], v = hits.v[i];
    const SmoothPoint smooth =
        smooth_point({{at.ax[i], at.ay[i], at.az[i]}, {normals.ax[i], normals.ay[i], normals.az[i]}, 1 - u - v},
                     {{at.bx[i], at.by[i], at.bz[i]}, {normals.bx[i], normals.by[i], normals.bz[i]}, u},
                     {{at.cx[i], at.cy[i], at.cz[i]}, {normals.cx[i], normals.cy[i], normals.cz[i]}, v},
                     {p.x[i], p.y[i], p.z[i]}, {p.face_x[i], p.face_y[i], p.face_z[i]});
    p.normal_x[i] = smooth.normal.x;
    p.normal_y[i] = smooth.normal.y;
    p.normal_z[i] = smooth.normal.z;
    p.offset_x[i] = smooth.shadow_offset.x;
    p.offset_y[i] = smooth.shadow_offset.y;
    p.offset_z[i] = smooth.shadow_offset.z;
  }
  for (int i = 0; i < lanes; ++i) {
    const bool flat = (mask >> i & 1) == 0;
    p.normal_x[i] = flat ? p.face_x[i] : p.normal_x[i];
    p.normal_y[i] = flat ? p.face_y[i] : p.normal_y[i];
    p.normal_z[i] = flat ? p.face_z[i] : p.normal_z[i];
    p.offset_x[i] = flat ? 0 : p.offset_x[i];
    p.offset_y[i] = flat ? 0 : p.offset_y[i];
    p.offset_z[i] = flat ? 0 : p.offset_z[i];
  }
}

template <class Vertex>
void gather(const std::array<std::uint32_t, 3>& vertices, const Vertex& vertex, int i, Vertices& to) {
  const Vec3 a = vertex(vertices[0]), b = vertex(vertices[1]), c = vertex(vertices[2]);
  to.ax[i] = a.x;
  to.ay[i] = a.y;
  to.az[i] = a.z;
  to.bx[i] = b.x;
  to.by[i] = b.y;
  to.bz[i] = b.z;
  to.cx[i] = c.x;
  to.cy[i] = c.y;
  to.cz[i] = c.z;
}

/// Computes the points of one packet, by kind of shape.
class PointComputation {
 public:
  PointComputation(const GeometrySet& geometry, const RayHitPacket& hits, PointPacket& points)
      : geometry_(geometry), hits_(hits), points_(points) {}

  void run() {
    const std::uint32_t triangles_from = geometry_.first_triangles(), quadrics_from = geometry_.first_quadrics();
    const std::uint32_t planes = geometry_.plane_geometry();
    LaneMask spheres = 0, triangles = 0, quadrics = 0, flat = 0;
    for (int i = 0; i < lanes; ++i) {
      const std::uint32_t set = hits_.primitive[i].geometry;
      (set < triangles_from  ? spheres
       : set < quadrics_from ? triangles
       : set < planes        ? quadrics
                             : flat) |= LaneMask{1} << i;
    }
    points_.smooth = false;
    if (spheres != 0) sphere_points(spheres);
    if (quadrics != 0) quadric_points(quadrics);
    if (flat != 0) plane_points(flat);
    if (triangles != 0) triangle_points(triangles);  // last, since smooth lanes write all normals
  }

 private:
  void sphere_points(LaneMask mask) {
    Spheres spheres{};
    for_each_lane(mask, [&](int i) {
      const auto [set, sphere] = hits_.primitive[i];
      const SphereGeometry& from = geometry_.spheres[set];
      spheres.x[i] = from.x[sphere];
      spheres.y[i] = from.y[sphere];
      spheres.z[i] = from.z[sphere];
      spheres.radius[i] = from.radius[sphere];
      points_.object[i] = from.object[sphere];
    });
    compute(mask, spheres);
  }

  void plane_points(LaneMask mask) {
    Planes planes{};
    for_each_lane(mask, [&](int i) {
      const std::uint32_t plane = hits_.primitive[i].primitive;
      const Vec3 &point = geometry_.planes.point[plane], &normal = geometry_.planes.normal[plane];
      planes.x[i] = point.x;
      planes.y[i] = point.y;
      planes.z[i] = point.z;
      planes.normal_x[i] = normal.x;
      planes.normal_y[i] = normal.y;
      planes.normal_z[i] = normal.z;
      points_.object[i] = geometry_.planes.object[plane];
    });
    compute(mask, planes);
  }

  void quadric_points(LaneMask mask) {
    QuadricPacket quadrics{};
    for_each_lane(mask, [&](int i) {
      const QuadricGeometry& from = geometry_.quadrics[hits_.primitive[i].geometry - geometry_.first_quadrics()];
      gather(from.quadrics[hits_.primitive[i].primitive], hits_.u[i], i, quadrics);
      points_.object[i] = from.object[hits_.primitive[i].primitive];
    });
    compute(mask, quadrics);
  }

  void triangle_points(LaneMask mask) {
    Vertices corners{}, normals{};
    LaneMask smooth_lanes = 0;
    for_each_lane(mask, [&](int i) {
      const TriangleGeometry& mesh = geometry_.triangles[hits_.primitive[i].geometry - geometry_.first_triangles()];
      const std::uint32_t triangle = hits_.primitive[i].primitive;
      const auto& vertices = mesh.triangles[triangle];
      gather(
          vertices, [&](std::uint32_t vertex) { return mesh.position(vertex); }, i, corners);
      points_.object[i] = mesh.object_of_triangle.empty() ? mesh.object : mesh.object_of_triangle[triangle];
      if (mesh.normals.empty()) return;
      smooth_lanes |= LaneMask{1} << i;
      const auto normal = [&](std::uint32_t vertex) -> Vec3 {
        const auto& [x, y, z] = mesh.normals[vertex];
        return {x, y, z};
      };
      gather(vertices, normal, i, normals);
    });
    compute(mask, corners);
    if (smooth_lanes == 0) return;
    points_.smooth = true;
    smooth(corners, normals, hits_, smooth_lanes, points_);
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
    for_each_lane(mask & ~computed, [this](int i) { compute_single(i); });
  }

  void compute_single(int i) {
    const ShapeHit at = shape_hit(geometry_, {hits_.primitive[i], 0, hits_.u[i], hits_.v[i]},
                                  {hits_.on_x[i], hits_.on_y[i], hits_.on_z[i]});
    const auto put = [i](const Vec3& v, double* x, double* y, double* z) {
      x[i] = v.x;
      y[i] = v.y;
      z[i] = v.z;
    };
    put(at.point.position, points_.x, points_.y, points_.z);
    put(at.point.error, points_.error_x, points_.error_y, points_.error_z);
    put(at.geometric_normal, points_.face_x, points_.face_y, points_.face_z);
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
