#include "tracer/src/shapes/point_packet.h"

#include "tracer/src/shapes/primitive_point.h"
#include "tracer/src/shapes/quadric_point.h"
#include "tracer/src/shapes/surface.h"

namespace tracer {
namespace {

/// Between these the largest component lies where normalize() divides by the length and does nothing else.
constexpr double plain_min = 0x1p-300, plain_max = 0x1p300;

/// All lanes together cost about what so many do one by one.
constexpr int worthwhile = 3;

/// The lanes of one kind of shape.
struct LaneList {
  int lane[lanes];
  int count = 0;
  void add(int i) { lane[count++] = i; }
  [[nodiscard]] const int* begin() const { return lane; }
  [[nodiscard]] const int* end() const { return lane + count; }
};

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
struct alignas(64) Quadrics {
  double x[lanes], y[lanes], z[lanes];
  double to_shape[9][lanes], from_shape[9][lanes];  ///< by columns
  double kind[lanes], part[lanes];                  ///< numbers: loops over doubles compare them
  double radius_0[lanes], radius_1[lanes], rims[lanes];
};

/// Of quadrics, in their own spaces: where the rays' arithmetic has the hits, and what is there.
struct alignas(64) ShapePoints {
  double on_x[lanes], on_y[lanes], on_z[lanes];
  double x[lanes], y[lanes], z[lanes];
  double normal_x[lanes], normal_y[lanes], normal_z[lanes];
};

/// What a loop answers, in all lanes.
struct alignas(64) Found {
  double x[lanes], y[lanes], z[lanes];
  double error_x[lanes], error_y[lanes], error_z[lanes];
  double face_x[lanes], face_y[lanes], face_z[lanes];
  double known[lanes];  ///< 1; 0: the lane needs care that no loop takes
};

struct alignas(64) Asked {
  double here[lanes] = {};  ///< 1: the lane is of the loop's kind
  explicit Asked(const LaneList& list) {
    for (const int i : list) here[i] = 1;
  }
};

WHITTLE_INLINE void put(const PrimitivePoint& at, int i, Found& to) {
  to.x[i] = at.position.x;
  to.y[i] = at.position.y;
  to.z[i] = at.position.z;
  to.error_x[i] = at.error.x;
  to.error_y[i] = at.error.y;
  to.error_z[i] = at.error.z;
  to.face_x[i] = at.across.x;
  to.face_y[i] = at.across.y;
  to.face_z[i] = at.across.z;
  to.known[i] = 1;
}

/// Makes directions across unit.
WHITTLE_INLINE void normalize(Found& to) {
  for (int i = 0; i < lanes; ++i) {
    const double across_x = to.face_x[i], across_y = to.face_y[i], across_z = to.face_z[i];
    const double x = std::abs(across_x), y = std::abs(across_y), z = std::abs(across_z);
    const double xy = x > y ? x : y, largest = xy > z ? xy : z;
    const double size = std::sqrt(across_x * across_x + across_y * across_y + across_z * across_z);
    to.face_x[i] = across_x / size;
    to.face_y[i] = across_y / size;
    to.face_z[i] = across_z / size;
    to.known[i] = (largest > plain_min) & (largest < plain_max) ? 1.0 : 0.0;
  }
}

WHITTLE_WIDE void meet(const Balls& __restrict s, const MetPacket& __restrict met, Found& __restrict to) {
  for (int i = 0; i < lanes; ++i)
    put(sphere_point({s.x[i], s.y[i], s.z[i]}, s.radius[i], {met.on_x[i], met.on_y[i], met.on_z[i]}), i, to);
}

WHITTLE_WIDE void meet(const Planes& __restrict s, const MetPacket& __restrict met, Found& __restrict to) {
  for (int i = 0; i < lanes; ++i)
    put(plane_point({s.x[i], s.y[i], s.z[i]}, {s.normal_x[i], s.normal_y[i], s.normal_z[i]},
                    {met.on_x[i], met.on_y[i], met.on_z[i]}),
        i, to);
}

WHITTLE_WIDE void meet(const Corner3& __restrict s, const MetPacket& __restrict met, Found& __restrict to) {
  for (int i = 0; i < lanes; ++i)
    put(triangle_point({s.ax[i], s.ay[i], s.az[i]}, {s.bx[i], s.by[i], s.bz[i]}, {s.cx[i], s.cy[i], s.cz[i]}, met.u[i],
                       met.v[i]),
        i, to);
  normalize(to);
}

WHITTLE_INLINE Linear lane_of(const double (&map)[9][lanes], int i) {
  return {{map[0][i], map[1][i], map[2][i]}, {map[3][i], map[4][i], map[5][i]}, {map[6][i], map[7][i], map[8][i]}};
}

// One loop for each kind of shape, over all lanes: in one alone they would be branches.

WHITTLE_INLINE void meet_sides(const Quadrics& __restrict s, ShapePoints& __restrict p) {
  for (int i = 0; i < lanes; ++i) {
    const ShapePoint at = on_side(s.radius_0[i], s.radius_1[i], {p.on_x[i], p.on_y[i], p.on_z[i]});
    p.x[i] = at.position.x;
    p.y[i] = at.position.y;
    p.z[i] = at.position.z;
    p.normal_x[i] = at.normal.x;
    p.normal_y[i] = at.normal.y;
    p.normal_z[i] = at.normal.z;
  }
}

WHITTLE_INLINE void meet_discs(const Quadrics& __restrict s, ShapePoints& __restrict p) {
  for (int i = 0; i < lanes; ++i) {
    const bool frustum = s.kind[i] == static_cast<double>(QuadricKind::frustum);
    const bool cap_0 = frustum & (s.part[i] == static_cast<double>(QuadricPart::cap_0));
    const bool cap_1 = frustum & (s.part[i] == static_cast<double>(QuadricPart::cap_1));
    const bool flat = cap_0 | cap_1 | (s.kind[i] == static_cast<double>(QuadricKind::disc));
    const double z = cap_1 ? 1 : 0, out = cap_0 ? -1 : 1;
    p.x[i] = flat ? p.on_x[i] : p.x[i];
    p.y[i] = flat ? p.on_y[i] : p.y[i];
    p.z[i] = flat ? z : p.z[i];
    p.normal_x[i] = flat ? 0 : p.normal_x[i];
    p.normal_y[i] = flat ? 0 : p.normal_y[i];
    p.normal_z[i] = flat ? out : p.normal_z[i];
  }
}

WHITTLE_INLINE void meet_boxes(const Quadrics& __restrict s, ShapePoints& __restrict p) {
  for (int i = 0; i < lanes; ++i) {
    const bool box = s.kind[i] == static_cast<double>(QuadricKind::box);
    const Vec3 out = out_of_box(s.part[i]);
    const double x = on_box(out.x, p.on_x[i]), y = on_box(out.y, p.on_y[i]), z = on_box(out.z, p.on_z[i]);
    p.x[i] = box ? x : p.x[i];
    p.y[i] = box ? y : p.y[i];
    p.z[i] = box ? z : p.z[i];
    p.normal_x[i] = box ? out.x : p.normal_x[i];
    p.normal_y[i] = box ? out.y : p.normal_y[i];
    p.normal_z[i] = box ? out.z : p.normal_z[i];
  }
}

WHITTLE_INLINE void meet_ellipsoids(const Quadrics& __restrict s, ShapePoints& __restrict p) {
  for (int i = 0; i < lanes; ++i) {
    const bool ball = s.kind[i] == static_cast<double>(QuadricKind::ellipsoid);
    const Vec3 at = on_ball({p.on_x[i], p.on_y[i], p.on_z[i]});
    p.normal_x[i] = ball ? at.x : p.normal_x[i];
    p.normal_y[i] = ball ? at.y : p.normal_y[i];
    p.normal_z[i] = ball ? at.z : p.normal_z[i];
    p.x[i] = ball ? at.x : p.x[i];
    p.y[i] = ball ? at.y : p.y[i];
    p.z[i] = ball ? at.z : p.z[i];
  }
}

WHITTLE_WIDE void meet(const Quadrics& __restrict s, const MetPacket& __restrict met, Found& __restrict to) {
  ShapePoints p;
  for (int i = 0; i < lanes; ++i) {
    const Vec3 on_ray{met.on_x[i], met.on_y[i], met.on_z[i]}, origin{s.x[i], s.y[i], s.z[i]};
    const Vec3 on = lane_of(s.to_shape, i) * (on_ray - origin);
    p.on_x[i] = on.x;
    p.on_y[i] = on.y;
    p.on_z[i] = on.z;
  }
  meet_sides(s, p);
  meet_discs(s, p);
  meet_boxes(s, p);
  meet_ellipsoids(s, p);
  for (int i = 0; i < lanes; ++i)
    put(placed({{p.x[i], p.y[i], p.z[i]}, {p.normal_x[i], p.normal_y[i], p.normal_z[i]}}, s.rims[i],
               {s.x[i], s.y[i], s.z[i]}, lane_of(s.to_shape, i), lane_of(s.from_shape, i)),
        i, to);
  normalize(to);
}

WHITTLE_INLINE void select(const double* __restrict asked, const double* __restrict found, double* __restrict to) {
  for (int i = 0; i < lanes; ++i) to[i] = asked[i] > 0 ? found[i] : to[i];
}

WHITTLE_WIDE void take(const Found& found, const Asked& asked, PointPacket& p) {
  select(asked.here, found.x, p.x);
  select(asked.here, found.y, p.y);
  select(asked.here, found.z, p.z);
  select(asked.here, found.error_x, p.error_x);
  select(asked.here, found.error_y, p.error_y);
  select(asked.here, found.error_z, p.error_z);
  select(asked.here, found.face_x, p.face_x);
  select(asked.here, found.face_y, p.face_y);
  select(asked.here, found.face_z, p.face_z);
}

/// What vertex normals make of the lanes asked; the faces are known.
WHITTLE_WIDE void smooth(const Corner3& __restrict at, const Corner3& __restrict normals,
                         const MetPacket& __restrict met, const Asked& __restrict asked, PointPacket& __restrict p) {
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
    const bool flat = !(asked.here[i] > 0);
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

void gather(const Linear& map, int i, double (&to)[9][lanes]) {
  int entry = 0;
  for (const Vec3& column : {map.x, map.y, map.z})
    for (const double value : {column.x, column.y, column.z}) to[entry++][i] = value;
}

void gather(const Quadric& from, double part, int i, Quadrics& to) {
  to.x[i] = from.origin.x;
  to.y[i] = from.origin.y;
  to.z[i] = from.origin.z;
  gather(from.shape_from_trace, i, to.to_shape);
  gather(from.trace_from_shape, i, to.from_shape);
  to.kind[i] = static_cast<double>(from.kind);
  to.part[i] = part;
  to.radius_0[i] = from.radius_0;
  to.radius_1[i] = from.radius_1;
  to.rims[i] = rims_of(from);
}

/// One meeting of a packet with a scene.
class Meeting {
 public:
  Meeting(const GeometrySet& geometry, const MetPacket& met, PointPacket& points)
      : geometry_(geometry), met_(met), points_(points) {}

  void meet_all() {
    const std::uint32_t triangles_from = geometry_.first_triangles(), quadrics_from = geometry_.first_quadrics();
    const std::uint32_t planes = geometry_.plane_geometry();
    LaneList balls, triangles, quadrics, flat;
    for (int i = 0; i < lanes; ++i) {
      const std::uint32_t set = met_.primitive[i].geometry;
      (set < triangles_from ? balls : set < quadrics_from ? triangles : set < planes ? quadrics : flat).add(i);
    }
    points_.smooth = false;
    if (balls.count > 0) meet_balls(balls);
    if (quadrics.count > 0) meet_quadrics(quadrics);
    if (flat.count > 0) meet_planes(flat);
    if (triangles.count > 0) meet_triangles(triangles);  // last: where some are smooth, all normals are written
  }

 private:
  void meet_balls(const LaneList& list) {
    Balls balls{};
    for (const int i : list) {
      const auto [set, sphere] = met_.primitive[i];
      const SphereGeometry& from = geometry_.spheres[set];
      balls.x[i] = from.x[sphere];
      balls.y[i] = from.y[sphere];
      balls.z[i] = from.z[sphere];
      balls.radius[i] = from.radius[sphere];
      points_.object[i] = from.object[sphere];
    }
    answer(list, balls);
  }

  void meet_planes(const LaneList& list) {
    Planes planes{};
    for (const int i : list) {
      const std::uint32_t plane = met_.primitive[i].primitive;
      const Vec3 &point = geometry_.planes.point[plane], &normal = geometry_.planes.normal[plane];
      planes.x[i] = point.x;
      planes.y[i] = point.y;
      planes.z[i] = point.z;
      planes.normal_x[i] = normal.x;
      planes.normal_y[i] = normal.y;
      planes.normal_z[i] = normal.z;
      points_.object[i] = geometry_.planes.object[plane];
    }
    answer(list, planes);
  }

  void meet_quadrics(const LaneList& list) {
    Quadrics quadrics{};
    for (const int i : list) {
      const QuadricGeometry& from = geometry_.quadrics[met_.primitive[i].geometry - geometry_.first_quadrics()];
      gather(from.quadrics[met_.primitive[i].primitive], met_.u[i], i, quadrics);
      points_.object[i] = from.object[met_.primitive[i].primitive];
    }
    answer(list, quadrics);
  }

  void meet_triangles(const LaneList& list) {
    Corner3 corners{}, normals{};
    LaneList smooth_lanes;
    for (const int i : list) {
      const TriangleGeometry& mesh = geometry_.triangles[met_.primitive[i].geometry - geometry_.first_triangles()];
      const std::uint32_t triangle = met_.primitive[i].primitive;
      const auto& vertices = mesh.triangles[triangle];
      gather(
          vertices, [&](std::uint32_t vertex) { return mesh.position(vertex); }, i, corners);
      points_.object[i] = mesh.object_of_triangle.empty() ? mesh.object : mesh.object_of_triangle[triangle];
      if (mesh.normals.empty()) continue;
      smooth_lanes.add(i);
      const auto normal = [&](std::uint32_t vertex) -> Vec3 {
        const auto& [x, y, z] = mesh.normals[vertex];
        return {x, y, z};
      };
      gather(vertices, normal, i, normals);
    }
    answer(list, corners);
    if (smooth_lanes.count == 0) return;
    points_.smooth = true;
    smooth(corners, normals, met_, Asked(smooth_lanes), points_);
  }

  template <class Shapes>
  void answer(const LaneList& list, const Shapes& shapes) {
    if (list.count >= worthwhile) {
      Found found;
      meet(shapes, met_, found);
      take(found, Asked(list), points_);
      for (const int i : list)
        if (!(found.known[i] > 0)) answer_alone(i);
    } else {
      for (const int i : list) answer_alone(i);
    }
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
  const MetPacket& met_;
  PointPacket& points_;
};

}  // namespace

void meet_points(const GeometrySet& geometry, const MetPacket& met, PointPacket& points) {
  Meeting(geometry, met, points).meet_all();
}

}  // namespace tracer
