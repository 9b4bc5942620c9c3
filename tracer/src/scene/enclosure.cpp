#include "tracer/src/scene/enclosure.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <variant>

#include "tracer/src/materials/compiled_material.h"
#include "tracer/src/scene/instancing.h"
#include "tracer/src/scene/render_space.h"

namespace tracer {
namespace {

using Coordinates = std::array<double, 3>;

Coordinates coordinates_of(const Vec3& v) { return {v.x, v.y, v.z}; }

/// Walls of the six sides of a box, from the surfaces that are added.
class Walls {
 public:
  Walls(const Bounds& bounds, const Vec3& camera)
      : low_(coordinates_of(bounds.low)), high_(coordinates_of(bounds.high)) {
    camera_ = coordinates_of(camera);
  }

  void add(const Shape& shape, const Affine& world_from_object) {
    const auto at = [&](const Vec3& p) { return world_from_object.point(p); };
    if (const auto* mesh = std::get_if<Mesh>(&shape)) {
      for (const auto& [a, b, c] : mesh->triangles)
        add_triangle({at(mesh->positions[a]), at(mesh->positions[b]), at(mesh->positions[c])});
    } else if (const auto* triangle = std::get_if<Triangle>(&shape)) {
      const auto& [a, b, c] = triangle->vertices;
      add_triangle({at(a), at(b), at(c)});
    } else if (const auto* box = std::get_if<Box>(&shape)) {
      add_box(*box, world_from_object);
    } else if (const auto* plane = std::get_if<Plane>(&shape)) {
      add_plane(at(plane->point), transformed_normal(world_from_object.linear, plane->normal));
    } else if (const auto* sphere = std::get_if<Sphere>(&shape)) {
      const Vec3 camera = Vec3{camera_[0], camera_[1], camera_[2]} - world_from_object.offset;
      const Vec3 local = inverse(world_from_object.linear) * camera - sphere->center;
      in_sphere_ = in_sphere_ || dot(local, local) < sphere->radius * sphere->radius;
    }
  }

  [[nodiscard]] Enclosure enclosure() const {
    if (in_sphere_) return Enclosure::closed;
    int walls = 0;
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (const bool upper : {false, true}) {
        const Side& side = sides_[axis][upper ? 1 : 0];
        const bool covered = side.area >= share_min * area(axis);
        const bool camera_beyond = upper ? camera_[axis] > high_[axis] : camera_[axis] < low_[axis];
        if (covered && camera_beyond) return Enclosure::none;  // in front of the back of a wall
        walls += covered || side.plane ? 1 : 0;
      }
    return walls == 6 ? Enclosure::closed : walls == 5 ? Enclosure::open : Enclosure::none;
  }

 private:
  static constexpr double share_min = 0.9;
  static constexpr double depth_max = 0.02;  // of a wall, relative to the box

  struct Side {
    double area = 0;     ///< faces along the side, projected onto it
    bool plane = false;  ///< a plane is on the side or beyond it
  };

  [[nodiscard]] double area(std::size_t axis) const {
    const std::size_t u = (axis + 1) % 3, v = (axis + 2) % 3;
    return (high_[u] - low_[u]) * (high_[v] - low_[v]);
  }

  [[nodiscard]] bool is_along(std::size_t axis, bool upper, double coordinate) const {
    const double slack = depth_max * (high_[axis] - low_[axis]);
    return upper ? coordinate >= high_[axis] - slack : coordinate <= low_[axis] + slack;
  }

  void add_triangle(const std::array<Vec3, 3>& corners) {
    const Coordinates twice_area = coordinates_of(cross(corners[1] - corners[0], corners[2] - corners[0]));
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (const bool upper : {false, true})
        if (std::ranges::all_of(corners, [&](const Vec3& p) { return is_along(axis, upper, coordinates_of(p)[axis]); }))
          sides_[axis][upper ? 1 : 0].area += std::abs(twice_area[axis]) / 2;
  }

  void add_box(const Box& box, const Affine& world_from_object) {
    std::array<Vec3, 8> corners{};
    for (std::size_t i = 0; i < 8; ++i)
      corners[i] = world_from_object.point({(i & 1) != 0 ? box.max.x : box.min.x, (i & 2) != 0 ? box.max.y : box.min.y,
                                            (i & 4) != 0 ? box.max.z : box.min.z});
    for (const std::size_t axis : {1, 2, 4})
      for (const std::size_t first : {std::size_t{0}, axis}) {
        const std::size_t u = axis == 1 ? 2 : 1, v = axis == 4 ? 2 : 4;
        add_triangle({corners[first], corners[first + u], corners[first + u + v]});
        add_triangle({corners[first], corners[first + u + v], corners[first + v]});
      }
  }

  void add_plane(const Vec3& point, const Vec3& normal) {
    constexpr double cosine_min = 0.99;
    const Coordinates n = coordinates_of(normalize(normal)), p = coordinates_of(point);
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (const bool upper : {false, true})
        if (std::abs(n[axis]) > cosine_min && is_along(axis, upper, p[axis])) sides_[axis][upper ? 1 : 0].plane = true;
  }

  Coordinates low_, high_, camera_{};
  std::array<std::array<Side, 2>, 3> sides_{};
  bool in_sphere_ = false;
};

}  // namespace

Enclosure enclosure_of_camera(const Scene& scene) {
  Walls walls(finite_bounds(scene), scene.camera.position);
  for_each_placed(scene, [&](const Placed& placed) {
    if (!lets_light_pass(scene.materials[placed.material.index])) walls.add(placed.shape, placed.world_from_object);
  });
  return walls.enclosure();
}

}  // namespace tracer
