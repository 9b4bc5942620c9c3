#include "tracer/src/certify/shadow_range.h"

#include <algorithm>

namespace tracer {
namespace {

/// Shadow rays of a patch to one light, and the primitives found among them.
class ShadowShaft {
 public:
  ShadowShaft(const SceneBounds& bounds, const SurfacePatch& patch, const CompiledLight& light)
      : bounds_(bounds), geometry_(bounds.scene.geometry()), patch_(patch), light_(light) {
    rays_.origin = patch.shadow_start;
    directional_ = light.kind == light_kind<DirectionalLight>;
    rays_.direction = directional_ ? exactly(light.axis) : light_points(light) - patch.shadow_start;
    // From a triangle with the light above it, shadow rays stay above its plane.
    on_triangle_ = geometry_.kind_of(patch.primitive.geometry) == GeometryKind::triangles;
    leaves_face_ = on_triangle_ && dot(rays_.direction, patch.face).range().low > 0;
  }

  /// True if the light shines on the back of the surface only.
  [[nodiscard]] bool is_behind() const {
    const AffineVec to_light = directional_ ? rays_.direction : light_points(light_) - patch_.position;
    return dot(patch_.normal, to_light).range().high < 0;
  }

  [[nodiscard]] Interval range() {
    const PlaneGeometry& planes = geometry_.planes;
    for (std::uint32_t k = 0; k < planes.point.size() && !ended(); ++k) add({geometry_.plane_geometry(), k});
    bounds_.tree.each(region(), [&](const PrimitiveRef& primitive) {
      add(primitive);
      return !ended();
    });
    if (dark_) return {0, 0};
    return {partial_ > 0 ? 0.0 : 1.0, transmissive_ || ended() ? bounds_.transmittance_max : 1.0};
  }

 private:
  /// Limits of the work for one light: more are rarely hidden behind one blocker.
  static constexpr int partial_max = 4, tests_max = 48;

  /// Dark, or given up.
  [[nodiscard]] bool ended() const { return dark_ || partial_ > partial_max || tests_ > tests_max; }

  /// The finite primitives that light from infinity may cross lie within twice the reach of the boxes along each axis.
  [[nodiscard]] ConvexRegion region() const {
    const Bounds from = box_of(patch_.shadow_start);
    if (!directional_) return shaft(from, box_of(light_points(light_)));
    const double length =
        4 * (bounds_.tree.reach() + std::max(largest_component(from.low), largest_component(from.high)));
    const Vec3 offset = light_.axis * length;
    return shaft(from, {from.low + offset, from.high + offset});
  }

  [[nodiscard]] bool is_transmissive(const PrimitiveRef& primitive) const {
    const std::uint32_t number = primitive.geometry;
    const GeometryKind kind = geometry_.kind_of(number);
    return kind == GeometryKind::spheres     ? geometry_.spheres[number].transmissive
           : kind == GeometryKind::triangles ? geometry_.mesh(number).transmissive
           : kind == GeometryKind::quadrics  ? geometry_.quadric_set(number).transmissive
                                             : geometry_.planes.transmissive[primitive.primitive] != 0;
  }

  void add(const PrimitiveRef& primitive) {
    const GeometryKind kind = geometry_.kind_of(primitive.geometry);
    const bool excluded = kind == GeometryKind::triangles || kind == GeometryKind::planes || patch_.convex;
    if (primitive == patch_.primitive && excluded) return;
    if (kind == GeometryKind::triangles && leaves_face_ && behind_face(primitive)) return;
    ++tests_;
    const bool transmissive = is_transmissive(primitive);
    const BundleHit hit = intersect(geometry_, primitive, rays_);
    if (hit.kind == BundleHit::Kind::miss) return;
    if (hit.kind == BundleHit::Kind::cover) {
      const Interval t = hit.t.range();
      if (!directional_ && t.low >= 1) return;
      // Shadow rays end 2^-40 of their length before the light.
      dark_ |= !transmissive && (directional_ || t.high < 1 - 0x1p-38);
    }
    ++partial_;
    transmissive_ |= transmissive;
  }

  /// A triangle is behind the patch's plane if its vertices are, up to the rounding of their heights; the offset of
  /// shadow rays covers that of shared vertices.
  [[nodiscard]] bool behind_face(const PrimitiveRef& primitive) const {
    const TriangleGeometry& mesh = geometry_.mesh(primitive.geometry);
    return std::ranges::all_of(mesh.triangles[primitive.primitive], [&](std::uint32_t vertex) {
      const Vec3 position = mesh.position(vertex), offset = position - patch_.anchor, size = abs(patch_.face);
      const double terms = dot(abs(offset), size) + dot(abs(position), size) + dot(abs(patch_.anchor), size);
      return dot(offset, patch_.face) <= terms * form_rounding;
    });
  }

  const SceneBounds& bounds_;
  const GeometrySet& geometry_;
  const SurfacePatch& patch_;
  const CompiledLight& light_;
  RayBundle rays_;
  bool directional_ = false, on_triangle_ = false, leaves_face_ = false;
  bool dark_ = false, transmissive_ = false;
  int partial_ = 0, tests_ = 0;
};

}  // namespace

AffineVec light_points(const CompiledLight& light) {
  if (!light.is_area_light()) return exactly(light.position);
  const Vec3 extent =
      light.kind == light_kind<SphereLight> ? Vec3{light.radius, light.radius, light.radius}
      : light.kind == light_kind<DiscLight>
          ? Vec3{std::hypot(light.u.x, light.v.x), std::hypot(light.u.y, light.v.y), std::hypot(light.u.z, light.v.z)}
          : (abs(light.u) + abs(light.v)) * 0.5;
  const Vec3 center = light_center(light);
  return widened(exactly(center), extent * (1 + 0x1p-40) + abs(center) * 0x1p-45);
}

Interval shadow_range(const SceneBounds& bounds, const SurfacePatch& patch, const CompiledLight& light) {
  if (!patch.has_normal) return {0, light.shadows ? bounds.transmittance_max : 1};
  ShadowShaft shaft(bounds, patch, light);
  if (shaft.is_behind()) return {0, 0};
  if (!light.shadows) return {1, 1};
  const Interval range = shaft.range();
  return {bounds.outside_absorbs ? 0 : range.low, range.high};
}

}  // namespace tracer
