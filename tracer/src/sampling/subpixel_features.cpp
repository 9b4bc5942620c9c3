#include "tracer/src/sampling/subpixel_features.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <numbers>
#include <numeric>
#include <optional>
#include <utility>

#include "tracer/src/math/sampling.h"
#include "tracer/src/shapes/shape_registry.h"

namespace tracer {
namespace {

/// Bounds of a thin object: the points within `radius` of the segment from center - axis to center + axis.
struct Capsule {
  Vec3 center, axis;
  double radius = 0;
};

Capsule bounding_capsule(const Quadric& quadric) {
  const Linear& m = quadric.render_from_shape;
  const Bounds box = local_box(quadric);
  const Vec3 extent = (box.high - box.low) * 0.5, middle = (box.low + box.high) * 0.5;
  std::array<Vec3, 3> half{m.x * extent.x, m.y * extent.y, m.z * extent.z};
  const Vec3 center = quadric.origin + m.x * middle.x + m.y * middle.y + m.z * middle.z;
  std::ranges::sort(half, [](const Vec3& a, const Vec3& b) { return dot(a, a) > dot(b, b); });
  return {center, half[0], length(half[1])};
}

bool reflects(const CompiledScene& scene, std::uint32_t object) {
  return max_component(scene.terms[scene.objects.material[object]].reflectance) > 0;
}

/// Infinite plane of a surface.
struct FlatSurface {
  Vec3 point, normal;  ///< unit
  bool reflects = false;
};

/// Planes of the scene's flat surfaces: at most `count_max`, those of meshes of few triangles.
std::vector<FlatSurface> flat_surfaces(const CompiledScene& scene, std::size_t count_max) {
  constexpr std::size_t triangles_max = 256;
  std::vector<FlatSurface> surfaces;
  const auto add = [&](const Vec3& point, const Vec3& normal, std::uint32_t object) {
    const bool mirror = reflects(scene, object);
    for (FlatSurface& other : surfaces)
      if (std::abs(dot(other.normal, normal)) > 1 - 1e-9 && std::abs(dot(point - other.point, normal)) < 1e-9) {
        other.reflects |= mirror;
        return;
      }
    if (surfaces.size() < count_max) surfaces.push_back({point, normal, mirror});
  };
  const GeometrySet& geometry = scene.geometry();
  for (std::size_t i = 0; i < geometry.planes.point.size(); ++i)
    add(geometry.planes.point[i], geometry.planes.normal[i], geometry.planes.object[i]);
  for (const TriangleGeometry& mesh : geometry.triangles) {
    if (mesh.triangles.size() > triangles_max || !mesh.normals.empty()) continue;
    for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
      const auto& [a, b, c] = mesh.triangles[i];
      const Vec3 normal = cross(mesh.position(b) - mesh.position(a), mesh.position(c) - mesh.position(a));
      if (dot(normal, normal) > 0) add(mesh.position(a), normalize(normal), mesh.object_of(i));
    }
  }
  for (const QuadricGeometry& quadrics : geometry.quadrics)
    for (std::size_t i = 0; i < quadrics.quadrics.size(); ++i) {
      const Quadric& q = quadrics.quadrics[i];
      if (q.kind == kind_of<UnitDisc>)
        add(q.origin, normalize(cross(q.render_from_shape.x, q.render_from_shape.y)), quadrics.object[i]);
    }
  return surfaces;
}

/// Bounds of the vertices, along the line from one of the farthest to the vertex farthest from it, moved to the mean of
/// the vertices: that line may be an edge.
Capsule bounding_capsule(std::span<const Vec3> vertices) {
  const auto farthest = [&](const Vec3& from) {
    return *std::ranges::max_element(vertices, {}, [&](const Vec3& v) { return dot(v - from, v - from); });
  };
  const Vec3 a = farthest(vertices[0]), b = farthest(a), axis = (b - a) * 0.5, middle = (a + b) * 0.5;
  const double squared = dot(axis, axis);
  const auto from_line = [&](const Vec3& offset) {
    return squared > 0 ? offset - axis * (dot(offset, axis) / squared) : offset;
  };
  Vec3 mean{};
  for (const Vec3& v : vertices) mean = mean + from_line(v - middle) * (1.0 / static_cast<double>(vertices.size()));
  Capsule capsule{middle + mean, axis, 0};
  for (const Vec3& v : vertices) capsule.radius = std::max(capsule.radius, length(from_line(v - capsule.center)));
  return capsule;
}

class FeatureFinder {
 public:
  FeatureFinder(const CompiledScene& scene, std::size_t count_max, std::size_t stride)
      : scene_(scene), window_(scene.image.window()), count_max_(count_max), stride_(stride) {}

  /// Also finds the features that these mirror, and their shadows there.
  void search(std::vector<FlatSurface> surfaces) { surfaces_ = std::move(surfaces); }

  /// Adds the features of every n-th capsule.
  template <class MakeCapsule>
  void add_one_of(const MakeCapsule& make_capsule) {
    if (candidates_++ % stride_ != 0) return;
    const Capsule capsule = make_capsule();
    add(capsule);
    for (const FlatSurface& surface : surfaces_) {
      if (surface.reflects) add(mirrored(capsule, surface));
      for (const CompiledLight& light : scene_.lights)
        if (const auto shadow = shadow_on(surface, light, capsule)) add(*shadow);
    }
  }

  /// Adds the image of a distant spot in a mirror ball: where the normal halves the angle between the directions to the
  /// eye and the spot, as large as a mirror of the focal length radius / 2 shows it.
  void add_reflection(const Capsule& ball, const CompiledBackground::Spot& spot) {
    for (std::size_t eye = 0; eye < scene_.camera.eyes() && features_.size() < count_max_; ++eye)
      for (const Vec3& direction : spot.directions) {
        Vec3 normal = direction;
        for (int step = 0; step < 16; ++step)
          normal = normalize(normalize(scene_.camera.position(eye) - ball.center - normal * ball.radius) + direction);
        add_step(ball.center + normal * ball.radius, ball.radius / 2 * spot.radius, 0, eye,
                 1.0 / static_cast<double>(spot.directions.size()));
      }
  }
  /// The same of the image in `other`, which is at a finite distance.
  void add_reflection(const Capsule& ball, const Capsule& other, const CompiledBackground::Spot& spot) {
    for (std::size_t eye = 0; eye < scene_.camera.eyes() && features_.size() < count_max_; ++eye) {
      Vec3 at = ball.center, there = other.center;
      for (int step = 0; step < 16; ++step) {
        const Vec3 way = normalize(there - at);
        at = ball.center + normalize(normalize(scene_.camera.position(eye) - at) + way) * ball.radius;
        there = other.center + normalize(spot.directions[0] - way) * other.radius;
      }
      add_step(at, ball.radius * other.radius / (4 * length(there - at)) * spot.radius, 0, eye);
    }
  }

  std::vector<SubpixelFeature> take() { return std::move(features_); }

 private:
  static Vec3 mirrored(const Vec3& offset, const Vec3& normal) { return offset - normal * (2 * dot(offset, normal)); }
  static Capsule mirrored(const Capsule& capsule, const FlatSurface& mirror) {
    return {mirror.point + mirrored(capsule.center - mirror.point, mirror.normal),
            mirrored(capsule.axis, mirror.normal), capsule.radius};
  }

  /// Shadow of a point: along the ray from the light, or from a light that is infinitely far.
  static std::optional<Vec3> shadow_on(const FlatSurface& surface, const CompiledLight& light, const Vec3& point) {
    const Vec3 middle = light.position + (light.u + light.v) * 0.5;
    const bool far = light.kind == light_kind<DirectionalLight>;
    const Vec3 direction = far ? -light.axis : point - middle;
    const double along = dot(surface.point - point, surface.normal) / dot(direction, surface.normal);
    if (!(along > 1e-9) || !std::isfinite(along)) return std::nullopt;
    return point + direction * along;
  }
  static std::optional<Capsule> shadow_on(const FlatSurface& surface, const CompiledLight& light,
                                          const Capsule& capsule) {
    if (!light.shadows || max_component(light.radiance) == 0) return std::nullopt;
    const auto a = shadow_on(surface, light, capsule.center - capsule.axis),
               b = shadow_on(surface, light, capsule.center + capsule.axis);
    if (!a || !b) return std::nullopt;
    const Vec3 center = (*a + *b) * 0.5;
    const bool far = light.kind == light_kind<DirectionalLight>;
    const double grown = far ? 1 : length(center - light.position) / length(capsule.center - light.position);
    return Capsule{center, (*b - *a) * 0.5, capsule.radius * grown};
  }

  void add(const Capsule& capsule) {
    for (std::size_t eye = 0; eye < scene_.camera.eyes(); ++eye) add(capsule, eye);
  }
  void add(const Capsule& capsule, std::size_t eye) {
    const double pixels = length(capsule.axis) / pixel_side(capsule.center, eye);
    // The projected thickness of a long capsule varies, so it is sampled in steps.
    const double longest = 2.0 * (scene_.image.width + scene_.image.height);
    const auto steps = static_cast<std::uint32_t>(std::clamp(std::ceil(2 * pixels), 1.0, longest));
    for (std::uint32_t step = 0; step < steps && features_.size() < count_max_; ++step) {
      const double along = (2 * step + 1.0) / steps - 1;
      add_step(capsule.center + capsule.axis * along, capsule.radius, 2 * length(capsule.axis) / steps, eye);
    }
  }

  [[nodiscard]] double pixel_side(const Vec3& point, std::size_t eye) const {
    const Vec3 offset = point - scene_.camera.position(eye);
    const CompiledCamera::Footprint footprint = scene_.camera.pixel_footprint(normalize(offset));
    return footprint.width + std::abs(footprint.spread) * length(offset);
  }

  /// `part`: of the share.
  void add_step(const Vec3& point, double radius, double step_length, std::size_t eye, double part = 1) {
    const double side = pixel_side(point, eye);
    if (!(radius < side)) return;
    const auto pixel = scene_.camera.project(point, eye);
    if (!pixel || !scene_.camera.is_in_image(*pixel, eye)) return;
    const double thickness = radius / side;
    const double share = part * std::numbers::pi * thickness * std::max(step_length / (2 * side), thickness);
    if (thickness < 0.1) return add_feature(*pixel, share);
    // It covers several pixels: one feature in the middle of each quarter.
    for (const double dx : {-0.5, 0.5})
      for (const double dy : {-0.5, 0.5})
        add_feature({pixel->x + dx * thickness, pixel->y + dy * thickness}, share / 4);
  }

  void add_feature(const Vec2& pixel, double share) {
    if (!(pixel.x >= window_.x0 && pixel.x < window_.x1 && pixel.y >= window_.y0 && pixel.y < window_.y1)) return;
    const double x = std::floor(pixel.x), y = std::floor(pixel.y);
    features_.push_back({static_cast<std::uint32_t>(x),
                         static_cast<std::uint32_t>(y),
                         {pixel.x - x, pixel.y - y},
                         static_cast<float>(std::min(share, 1.0)),
                         static_cast<float>(stride_)});
  }

  const CompiledScene& scene_;
  PixelWindow window_;
  std::size_t count_max_, stride_, candidates_ = 0;
  std::vector<FlatSurface> surfaces_;
  std::vector<SubpixelFeature> features_;
};

/// Sets of triangles that are connected by vertices at the same positions, in all meshes of a scene.
class ConnectedTriangles {
 public:
  /// None if there are more than `triangles_max`.
  ConnectedTriangles(const std::vector<TriangleGeometry>& meshes, std::size_t triangles_max) {
    std::size_t triangles = 0;
    for (const TriangleGeometry& mesh : meshes) triangles += mesh.triangles.size();
    if (triangles > triangles_max) return;
    corners_.reserve(3 * triangles);
    for (const TriangleGeometry& mesh : meshes)
      for (const auto& vertices : mesh.triangles)
        for (const std::uint32_t vertex : vertices) corners_.push_back(mesh.position(vertex));
    parent_.resize(corners_.size());
    std::iota(parent_.begin(), parent_.end(), 0u);
    for (std::uint32_t i = 0; i < parent_.size(); i += 3) parent_[i + 1] = parent_[i + 2] = i;
    unite_equal_positions();
  }

  /// Calls use(corners) for each set of few triangles.
  template <class Use>
  void each_small_set(const Use& use) {
    std::vector<std::pair<std::uint32_t, std::uint32_t>> by_set;
    for (std::uint32_t i = 0; i < corners_.size(); ++i) by_set.emplace_back(root(i), i);
    std::ranges::sort(by_set);
    std::vector<Vec3> corners;
    for (std::size_t first = 0, last = 0; first < by_set.size(); first = last) {
      corners.clear();
      for (; last < by_set.size() && by_set[last].first == by_set[first].first; ++last)
        corners.push_back(corners_[by_set[last].second]);
      if (corners.size() <= corners_max) use(std::span<const Vec3>(corners));
    }
  }

 private:
  static constexpr std::size_t corners_max = 3 * 64;

  void unite_equal_positions() {
    std::vector<std::pair<std::uint64_t, std::uint32_t>> keys;
    for (std::uint32_t i = 0; i < corners_.size(); ++i) {
      std::uint64_t key = 0;
      for (const double value : {corners_[i].x, corners_[i].y, corners_[i].z})
        key = mix(key ^ std::bit_cast<std::uint64_t>(value));
      keys.emplace_back(key, i);
    }
    std::ranges::sort(keys);
    for (std::size_t i = 1; i < keys.size(); ++i)
      if (keys[i].first == keys[i - 1].first) parent_[root(keys[i].second)] = root(keys[i - 1].second);
  }

  std::uint32_t root(std::uint32_t corner) {
    while (parent_[corner] != corner) corner = parent_[corner] = parent_[parent_[corner]];
    return corner;
  }

  std::vector<Vec3> corners_;          ///< three for each triangle
  std::vector<std::uint32_t> parent_;  ///< corner of the same set; a root is its own
};

}  // namespace

std::vector<SubpixelFeature> find_subpixel_features(const CompiledScene& scene, std::size_t count_max, bool indirect) {
  const GeometrySet& geometry = scene.geometry();
  std::size_t candidates = 0;
  for (const SphereGeometry& spheres : geometry.spheres) candidates += spheres.radius.size();
  for (const QuadricGeometry& quadrics : geometry.quadrics) candidates += quadrics.quadrics.size();
  ConnectedTriangles triangles(geometry.triangles, 1024 + scene.image.window().pixels() / 64);
  triangles.each_small_set([&](std::span<const Vec3>) { ++candidates; });
  FeatureFinder finder(scene, count_max, candidates / std::max<std::size_t>(1, count_max) + 1);
  if (indirect && candidates > 0) {
    constexpr std::size_t views_max = 1 << 16;  // milliseconds
    finder.search(
        flat_surfaces(scene, std::min<std::size_t>(16, views_max / (candidates * (1 + scene.lights.size())))));
  }
  const auto sun = indirect ? scene.background->brightest() : std::nullopt;
  std::vector<Capsule> mirrors;
  for (const SphereGeometry& spheres : geometry.spheres)
    for (std::size_t i = 0; i < spheres.radius.size(); ++i) {
      const Capsule ball{{spheres.x[i], spheres.y[i], spheres.z[i]}, {}, spheres.radius[i]};
      finder.add_one_of([&] { return ball; });
      if (sun && reflects(scene, spheres.object[i])) mirrors.push_back(ball);
    }
  for (const Capsule& ball : mirrors) finder.add_reflection(ball, *sun);
  if (mirrors.size() < 128)
    for (const Capsule& ball : mirrors)
      for (const Capsule& other : mirrors)
        if (&ball != &other) finder.add_reflection(ball, other, *sun);
  for (const QuadricGeometry& quadrics : geometry.quadrics)
    for (const Quadric& quadric : quadrics.quadrics) finder.add_one_of([&] { return bounding_capsule(quadric); });
  triangles.each_small_set(
      [&](std::span<const Vec3> corners) { finder.add_one_of([&] { return bounding_capsule(corners); }); });
  return finder.take();
}

}  // namespace tracer
