#pragma once
/// A second tracer, to judge the first by: Whitted's recursion as the scene document defines it, in long double, one
/// ray at a time, every object tried for every ray. It shares no code with the tracer, and works otherwise where it
/// can: no acceleration, no ray offsets (a ray knows what it starts on and solves for the other root), recursion.
///
/// Spheres, planes, triangles and meshes; all of a scene's lights, materials and textures. Slow: some 10^5 rays a
/// second for ten objects. Const calls may run on any thread.

#include <vector>

#include "tests/support/long_vec.h"
#include "tracer/render.h"

namespace oracle {

/// What one camera ray brings.
struct Sample {
  Light3 radiance;
  /// How near the path came to taking another turn: the least relative distance of any of its rays from a silhouette, a
  /// shadow's or a checker's edge, a surface that coincides, the critical angle, or the cutoff. Where it is tiny, a
  /// tracer that rounds may decide otherwise and be right.
  Real margin = 1;
};

class ReferenceTracer {
 public:
  /// Precondition: `validate` finds nothing in `scene`, which must outlive this.
  explicit ReferenceTracer(const tracer::Scene& scene);

  /// Radiance at the image position (x, y), in pixels from the upper left corner. Adds what was traced to `counted`.
  [[nodiscard]] Sample sample(Real x, Real y, tracer::RenderStatistics& counted) const;

  /// Every pixel's centre, row 0 on top.
  [[nodiscard]] std::vector<Sample> image(tracer::RenderStatistics& counted) const;

 private:
  struct Ray;
  struct Hit;
  struct Point;
  struct Path;
  struct Face {
    Vec a, b, c;     // corners
    Vec na, nb, nc;  // normals; zero: the face's
    tracer::Vec2 ta, tb, tc;
  };
  struct Body;
  using Inside = std::vector<const Body*>;
  struct Body {
    const tracer::Shape* shape;
    const tracer::Material* material;
    std::vector<Face> faces;  // of triangles and meshes
  };

  [[nodiscard]] static Inside beyond(Inside inside, const Point& point);
  [[nodiscard]] static const Body* current_medium(const Inside& inside);
  [[nodiscard]] Inside around_camera(Path& path) const;
  [[nodiscard]] Hit nearest(const Ray& ray, Path& path) const;
  [[nodiscard]] Point point_at(const Ray& ray, const Hit& hit) const;
  [[nodiscard]] Light3 surface_color(const Point& point, Path& path) const;
  [[nodiscard]] Light3 trace(const Ray& ray, const Light3& weight, std::uint32_t depth, Path& path) const;
  [[nodiscard]] Light3 local(const Ray& ray, const Point& point, const Light3& weight, Path& path) const;
  [[nodiscard]] Light3 visible(const Inside& around, const Point& point, const Vec& to_light, Real distance,
                               Path& path) const;
  [[nodiscard]] Light3 bounced(const Ray& ray, const Point& point, const Light3& weight, std::uint32_t depth,
                               Path& path) const;
  [[nodiscard]] Light3 follow(const Point& point, const Vec& direction, const Inside& inside, const Light3& weight,
                              const Light3& factor, std::uint32_t depth, std::uint64_t& kind, Path& path) const;

  const tracer::Scene& scene_;
  std::vector<Body> bodies_;
  Vec forward_, right_, up_;
};

}  // namespace oracle
