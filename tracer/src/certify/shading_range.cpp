#include "tracer/src/certify/shading_range.h"

#include <algorithm>

#include "tracer/src/math/power.h"

namespace tracer {
namespace {

/// Points of a light, unless it is directional.
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

/// Rounding of unit vectors, cosines and powers in the integrator: they differ from the forms by less.
constexpr double cosine_slack = 0x1p-44;

Interval product(const Interval& a, const Interval& b) {
  return {a.low * b.low, a.high > 0 && b.high > 0 ? a.high * b.high : 0};
}

/// The attenuation falls with the distance.
Interval attenuation_range(const Attenuation& attenuation, const Interval& distance) {
  const auto at = [&](double d) {
    return attenuation.kind == Attenuation::Kind::inverse_square ? inverse_square_attenuation(d)
                                                                 : polynomial_attenuation(attenuation.coefficients, d);
  };
  if (attenuation.kind == Attenuation::Kind::none) return {1, 1};
  if (!(distance.low > 0)) return {0, attenuation_bound(attenuation)};
  return {at(distance.high) * (1 - 0x1p-40), at(distance.low) * (1 + 0x1p-40)};
}

/// The factor grows with the cosine; its slope is at most 1.5 over the difference of the cosines.
Interval spot_range(const CompiledLight& light, const Interval& cosine) {
  const double width = light.cos_inner - light.cos_outer, slack = width > 0 ? 2 * cosine_slack / width : 0;
  const auto factor = [&](double c) { return spot_factor(c, light.cos_inner, light.cos_outer); };
  return {std::max(0.0, factor(cosine.low - cosine_slack) - slack),
          std::min(1.0, factor(cosine.high + cosine_slack) + slack)};
}

/// Range of c^n for c clamped to [0, 1].
Interval power_range(const Interval& base, double exponent) {
  const double slack = 0x1p-44 * (1 + exponent);  // the error of the logarithm is multiplied by the exponent
  return {std::max(0.0, power_of(std::clamp(base.low - cosine_slack, 0.0, 1.0), exponent) - slack),
          std::min(1.0, power_of(std::clamp(base.high + cosine_slack, 0.0, 1.0), exponent) + slack)};
}

/// Factors of a light that shines on the patch.
struct LightRange {
  Interval diffuse{}, specular{};  ///< N.L and the highlight, both with the attenuation
};

LightRange light_range(const SceneBounds& bounds, const SurfacePatch& patch, const RayBundle& rays,
                       const CompiledLight& light) {
  const CompiledMaterial& material = bounds.scene.terms[patch.material];
  const bool directional = light.kind == light_kind<DirectionalLight>;
  AffineVec to_light = exactly(light.axis);
  Interval strength{1, 1};
  if (!directional) {
    const AffineVec offset = light_points(light) - patch.position;
    const AffineForm distance = square_root(squared_length(offset));
    to_light = offset * inverse(distance);
    const AffineForm world = distance * bounds.scene.frame.world_from_render(1.0);
    strength = attenuation_range(light.attenuation, world.range());
    if (light.kind == light_kind<SpotLight>)
      strength = product(strength, spot_range(light, (-dot(to_light, light.axis)).range()));
  }
  AffineForm cosine = dot(patch.normal, to_light);
  cosine.error += cosine_slack;
  const auto [low, high] = cosine.range();
  if (!(high > 0)) return {};
  LightRange range{product({std::max(0.0, low), std::min(high, 1 + 0x1p-40)}, strength), {}};
  if (is_black(material.specular)) return range;
  // phong_cosine() or blinn_cosine() to the material's power.
  const AffineVec to_eye = -normalized(rays.direction);
  const AffineForm to_normal = dot(patch.normal, to_eye), between = dot(to_light, to_eye);
  const AffineForm base =
      material.blinn ? (cosine + to_normal) * inverse(square_root(between * 2 + 2)) : cosine * to_normal * 2 - between;
  const Interval power = power_range(base.range(), material.shininess);
  range.specular = product({low > 0 ? power.low : 0, power.high}, strength);
  return range;
}

}  // namespace

Interval shadow_range(const SceneBounds& bounds, const SurfacePatch& patch, const CompiledLight& light) {
  if (!patch.has_normal) return {0, light.shadows ? bounds.transmittance_max : 1};
  ShadowShaft shaft(bounds, patch, light);
  if (shaft.is_behind()) return {0, 0};
  if (!light.shadows) return {1, 1};
  const Interval range = shaft.range();
  return {bounds.outside_absorbs ? 0 : range.low, range.high};
}

ColorInterval shading_range(const SceneBounds& bounds, const SurfacePatch& patch, const RayBundle& rays,
                            std::span<const Interval> visible) {
  const SceneBounds::MaterialRange& material = bounds.materials[patch.material];
  if (!patch.has_normal || material.may_be_hidden) return material.anywhere;
  ColorInterval added{};
  for (std::size_t number = 0; number < visible.size(); ++number) {
    const CompiledLight& light = bounds.scene.lights[number];
    if (visible[number].high == 0) continue;
    const LightRange range = light_range(bounds, patch, rays, light);
    const std::array<double, 3> radiance{light.radiance.r, light.radiance.g, light.radiance.b};
    for (std::size_t c = 0; c < 3; ++c) {
      const Interval diffuse = product(range.diffuse, material.diffuse[c]),
                     specular = product(range.specular, material.specular[c]),
                     lit = product(product({diffuse.low + specular.low, diffuse.high + specular.high}, visible[number]),
                                   {radiance[c], radiance[c]});
      added[c].low += bounds.culls ? 0 : lit.low;
      added[c].high += lit.high;
    }
  }
  ColorInterval range;
  for (std::size_t c = 0; c < 3; ++c) {
    added[c].high += material.other_max[c];
    range[c] = sum(material.emitted_ambient[c], added[c]);
    range[c].high = std::min(range[c].high, material.anywhere[c].high);
  }
  return range;
}

}  // namespace tracer
