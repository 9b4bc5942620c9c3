#pragma once
/// A reference tracer: Whitted's recursion as defined by the scene document, in long double, one ray at a time, without
/// an accelerator. It shares no code with the tracer and uses different methods where possible: no ray offsets (a ray
/// records its surface and solves for the other root), recursion.
///
/// Spheres, planes, triangles and meshes; all of a scene's lights, materials and textures. Slow: some 10^5 rays a
/// second for ten objects. Const calls may run on any thread.

#include <vector>

#include "tests/support/long_vec.h"
#include "tracer/render.h"

namespace oracle {

/// Result of one camera ray.
struct Sample {
  Light3 radiance;
  /// Margin of the decisions along the path: the minimum relative distance of its rays from a silhouette, a shadow's or
  /// a checker's edge, a coincident surface, the critical angle, or the cutoff. If it is tiny, a tracer with rounding
  /// errors may decide differently and be right.
  Real margin = 1;
};

class ReferenceTracer {
 public:
  /// Precondition: `validate` finds nothing in `scene`, which must outlive this.
  explicit ReferenceTracer(const tracer::Scene& scene);

  /// Radiance at the image position (x, y), in pixels from the upper left corner. Adds what was traced to `counted`.
  [[nodiscard]] Sample sample(Real x, Real y, tracer::RenderStatistics& counted) const;

  /// Radiance at every pixel's center, row 0 on top.
  [[nodiscard]] std::vector<Sample> image(tracer::RenderStatistics& counted) const;

 private:
  struct Ray;
  struct Hit;
  struct Point;
  struct Path;
  struct Face {
    Vec a, b, c;           // corners
    Vec na{}, nb{}, nc{};  // normals; zero: the face's
    tracer::Vec2 ta{0, 0}, tb{1, 0}, tc{0, 1};
  };
  struct Body;
  using Inside = std::vector<const Body*>;
  struct Body {
    const tracer::Shape* shape;
    const tracer::Material* material;
    std::vector<Face> faces;  // of triangles and meshes
    float size = 0;           // diagonal of the bounding box
    bool closed = true;       // encloses a volume
    bool has_medium = false;  // a ray that enters it is in its medium
  };

  struct Interface {
    Inside after;  // the media of a ray that passes
    Real n_from, n_to;
  };

  [[nodiscard]] static Inside beyond(Inside inside, const Point& point);
  [[nodiscard]] static Interface interface_at(const Ray& ray, const Point& point);
  [[nodiscard]] static const Body* current_medium(const Inside& inside);
  [[nodiscard]] static bool hides(const Inside& before, const Inside& after, const Body* body);
  [[nodiscard]] Inside around_camera(Path& path) const;
  [[nodiscard]] Hit nearest(const Ray& ray, Path& path) const;
  [[nodiscard]] Point point_at(const Ray& ray, const Hit& hit) const;
  [[nodiscard]] Light3 color_at(const tracer::ColorOrTexture& color, const Point& point, Path& path) const;
  [[nodiscard]] Light3 trace(const Ray& ray, const Light3& weight, std::uint32_t depth, Path& path) const;
  [[nodiscard]] Light3 local(const Ray& ray, const Point& point, const Light3& weight, Path& path) const;
  [[nodiscard]] Light3 visible(Ray ray, Path& path) const;
  [[nodiscard]] Light3 bounced(const Ray& ray, const Point& point, const Light3& weight, std::uint32_t depth,
                               Path& path) const;
  [[nodiscard]] Light3 follow(const Point& point, const Vec& direction, const Inside& inside, const Light3& weight,
                              const Light3& factor, std::uint32_t depth, std::uint64_t& kind, Path& path) const;

  const tracer::Scene& scene_;
  std::vector<Body> bodies_;
  Vec forward_, right_, up_;
};

}  // namespace oracle
