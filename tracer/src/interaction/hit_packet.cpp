#include "tracer/src/interaction/hit_packet.h"

#include "tracer/src/interaction/quadric_hits.h"
#include "tracer/src/interaction/surface.h"

namespace tracer {
namespace {

/// All lanes together cost about what so many do one by one.
constexpr int worthwhile = 3;

// What the lanes of a kind need to know of their shapes; the other lanes hold anything.
struct alignas(64) Balls {
  double x[lanes], y[lanes], z[lanes], radius[lanes];
};
struct alignas(64) Planes {
  double x[lanes], y[lanes], z[lanes];
  double normal_x[lanes], normal_y[lanes], normal_z[lanes];
};
struct alignas(64) Corner3 {
  double ax[lanes], ay[lanes], az[lanes];
  double bx[lanes], by[lanes], bz[lanes];
  double cx[lanes], cy[lanes], cz[lanes];
};
WHITTLE_WIDE LaneMask meet(const Balls& __restrict s, const RayHitPacket& __restrict met, FacePacket& __restrict to) {
  for (int i = 0; i < lanes; ++i)
    put(sphere_point({s.x[i], s.y[i], s.z[i]}, s.radius[i], {met.on_x[i], met.on_y[i], met.on_z[i]}), i, to);
  return all_lanes;
}

WHITTLE_WIDE LaneMask meet(const Planes& __restrict s, const RayHitPacket& __restrict met, FacePacket& __restrict to) {
  for (int i = 0; i < lanes; ++i)
    put(plane_point({s.x[i], s.y[i], s.z[i]}, {s.normal_x[i], s.normal_y[i], s.normal_z[i]},
                    {met.on_x[i], met.on_y[i], met.on_z[i]}),
        i, to);
  return all_lanes;
}

WHITTLE_WIDE LaneMask meet(const Corner3& __restrict s, const RayHitPacket& __restrict met, FacePacket& __restrict to) {
  for (int i = 0; i < lanes; ++i)
    put(triangle_point({s.ax[i], s.ay[i], s.az[i]}, {s.bx[i], s.by[i], s.bz[i]}, {s.cx[i], s.cy[i], s.cz[i]}, met.u[i],
                       met.v[i]),
        i, to);
  return normalize(to);
}

WHITTLE_INLINE void select(const double* __restrict found, LaneMask wanted, double* __restrict to) {
  for (int i = 0; i < lanes; ++i) to[i] = (wanted >> i & 1) != 0 ? found[i] : to[i];
}

WHITTLE_WIDE void take(const FacePacket& found, LaneMask wanted, FacePacket& p) {
  select(found.x, wanted, p.x);
  select(found.y, wanted, p.y);
  select(found.z, wanted, p.z);
  select(found.error_x, wanted, p.error_x);
  select(found.error_y, wanted, p.error_y);
  select(found.error_z, wanted, p.error_z);
  select(found.face_x, wanted, p.face_x);
  select(found.face_y, wanted, p.face_y);
  select(found.face_z, wanted, p.face_z);
}

/// What vertex normals make of the lanes wanted; the faces are known.
WHITTLE_WIDE void smooth(const Corner3& __restrict at, const Corner3& __restrict normals,
                         const RayHitPacket& __restrict met, LaneMask wanted, PointPacket& __restrict p) {
  for (int i = 0; i < lanes; ++i) {
    const double u = met.u[i], v = met.v[i];
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
    const bool flat = (wanted >> i & 1) == 0;
    p.normal_x[i] = flat ? p.face_x[i] : p.normal_x[i];
    p.normal_y[i] = flat ? p.face_y[i] : p.normal_y[i];
    p.normal_z[i] = flat ? p.face_z[i] : p.normal_z[i];
    p.offset_x[i] = flat ? 0 : p.offset_x[i];
    p.offset_y[i] = flat ? 0 : p.offset_y[i];
    p.offset_z[i] = flat ? 0 : p.offset_z[i];
  }
}

template <class Vertex>
void gather(const std::array<std::uint32_t, 3>& vertices, const Vertex& vertex, int i, Corner3& to) {
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

/// One meeting of a packet with a scene.
class Meeting {
 public:
  Meeting(const GeometrySet& geometry, const RayHitPacket& met, PointPacket& points)
      : geometry_(geometry), met_(met), points_(points) {}

  void compute_points() {
    const std::uint32_t triangles_from = geometry_.first_triangles(), quadrics_from = geometry_.first_quadrics();
    const std::uint32_t planes = geometry_.plane_geometry();
    LaneMask balls = 0, triangles = 0, quadrics = 0, flat = 0;
    for (int i = 0; i < lanes; ++i) {
      const std::uint32_t set = met_.primitive[i].geometry;
      (set < triangles_from  ? balls
       : set < quadrics_from ? triangles
       : set < planes        ? quadrics
                             : flat) |= LaneMask{1} << i;
    }
    points_.smooth = false;
    if (balls != 0) sphere_points(balls);
    if (quadrics != 0) meet_quadrics(quadrics);
    if (flat != 0) plane_points(flat);
    if (triangles != 0) triangle_points(triangles);  // last: where some are smooth, all normals are written
  }

 private:
  void sphere_points(LaneMask mask) {
    Balls balls{};
    for_each_lane(mask, [&](int i) {
      const auto [set, sphere] = met_.primitive[i];
      const SphereGeometry& from = geometry_.spheres[set];
      balls.x[i] = from.x[sphere];
      balls.y[i] = from.y[sphere];
      balls.z[i] = from.z[sphere];
      balls.radius[i] = from.radius[sphere];
      points_.object[i] = from.object[sphere];
    });
    answer(mask, balls);
  }

  void plane_points(LaneMask mask) {
    Planes planes{};
    for_each_lane(mask, [&](int i) {
      const std::uint32_t plane = met_.primitive[i].primitive;
      const Vec3 &point = geometry_.planes.point[plane], &normal = geometry_.planes.normal[plane];
      planes.x[i] = point.x;
      planes.y[i] = point.y;
      planes.z[i] = point.z;
      planes.normal_x[i] = normal.x;
      planes.normal_y[i] = normal.y;
      planes.normal_z[i] = normal.z;
      points_.object[i] = geometry_.planes.object[plane];
    });
    answer(mask, planes);
  }

  void meet_quadrics(LaneMask mask) {
    QuadricPacket quadrics{};
    for_each_lane(mask, [&](int i) {
      const QuadricGeometry& from = geometry_.quadrics[met_.primitive[i].geometry - geometry_.first_quadrics()];
      gather(from.quadrics[met_.primitive[i].primitive], met_.u[i], i, quadrics);
      points_.object[i] = from.object[met_.primitive[i].primitive];
    });
    answer(mask, quadrics);
  }

  void triangle_points(LaneMask mask) {
    Corner3 corners{}, normals{};
    LaneMask smooth_lanes = 0;
    for_each_lane(mask, [&](int i) {
      const TriangleGeometry& mesh = geometry_.triangles[met_.primitive[i].geometry - geometry_.first_triangles()];
      const std::uint32_t triangle = met_.primitive[i].primitive;
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
    answer(mask, corners);
    if (smooth_lanes == 0) return;
    points_.smooth = true;
    smooth(corners, normals, met_, smooth_lanes, points_);
  }

  template <class Shapes>
  void answer(LaneMask wanted, const Shapes& shapes) {
    LaneMask answered = 0;
    if (wanted == all_lanes) {
      answered = meet(shapes, met_, points_);
    } else if (std::popcount(wanted) >= worthwhile) {
      FacePacket found;
      answered = meet(shapes, met_, found);
      take(found, wanted, points_);
    }
    for_each_lane(wanted & ~answered, [this](int i) { answer_alone(i); });
  }

  void answer_alone(int i) {
    const ShapeHit at =
        shape_hit(geometry_, {met_.primitive[i], 0, met_.u[i], met_.v[i]}, {met_.on_x[i], met_.on_y[i], met_.on_z[i]});
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
  const RayHitPacket& met_;
  PointPacket& points_;
};

}  // namespace

void meet_points(const GeometrySet& geometry, const RayHitPacket& met, PointPacket& points) {
  Meeting(geometry, met, points).compute_points();
}

}  // namespace tracer
