#include "tracer/src/certify/shadow_range.h"

#include "tracer/src/certify/triangle_hit.h"

namespace tracer {
namespace {

/// Shadow rays of a patch to one light, and the primitives found among them.
class ShadowShaft {
 public:
  ShadowShaft(const SceneBounds& bounds, const SurfacePatch& patch, const CompiledLight& light, Occluders* found)
      : bounds_(bounds), geometry_(bounds.scene.geometry()), patch_(patch), light_(light), found_(found) {
    rays_.origin = patch.shadow_start;
    directional_ = light.kind == light_kind<DirectionalLight>;
    rays_.direction = directional_ ? exactly(light.axis) : light_points(light) - patch.shadow_start;
    // From a triangle with the light above it, shadow rays stay above its plane.
    on_triangle_ = patch.primitive.hit() && geometry_.kind_of(patch.primitive.geometry) == GeometryKind::triangles;
    leaves_face_ = on_triangle_ && patch.has_normal && dot(rays_.direction, patch.flat_normal).range().low > 0;
  }

  /// True if the light shines on the back of the surface only.
  [[nodiscard]] bool is_behind() const {
    const AffineVec to_light = directional_ ? rays_.direction : light_points(light_) - patch_.position;
    return patch_.has_normal && dot(patch_.normal, to_light).range().high < 0;
  }

  /// Tests the primitives of `known`, or all of the scene.
  [[nodiscard]] Interval range(const Occluders& known) {
    if (known.state == Occluders::State::unknown) {
      const PlaneGeometry& planes = geometry_.planes;
      for (std::uint32_t k = 0; k < planes.point.size() && !ended(); ++k) add({geometry_.plane_geometry(), k});
      if (!ended()) gather();
    } else {
      // A shaft is worth its planes for several triangles.
      const bool many = known.count > 3 && geometry_.kind_of(known.primitives[0].geometry) == GeometryKind::triangles;
      const ConvexRegion region = many ? this->region() : ConvexRegion();
      for (std::size_t i = 0; i < known.count && !ended(); ++i) {
        const auto& [number, primitive] = known.primitives[i];
        if (many && geometry_.kind_of(number) == GeometryKind::triangles &&
            is_outside(geometry_.mesh(number), primitive, region))
          continue;
        add(known.primitives[i]);
      }
    }
    if (dark_) return {0, 0};
    if (ended()) return {0, bounds_.transmittance_max};
    if (found_ != nullptr && !overflows_) {
      found_->state = partial_ > 0 ? Occluders::State::some : Occluders::State::lit;
      found_->count = static_cast<std::uint8_t>(partial_);
    }
    return {partial_ > 0 ? 0.0 : 1.0, transmissive_ ? bounds_.transmittance_max : 1.0};
  }

 private:
  /// Limits of the work for one light: more are rarely hidden behind one blocker.
  static constexpr int partial_max = 4, tests_max = 48, stack_size = 64;

  /// Dark, or given up. Lists of occluders for parts of the patch are worth more work.
  [[nodiscard]] bool ended() const {
    if (dark_) return true;
    return found_ != nullptr ? overflows_ : partial_ > partial_max || tests_ > tests_max;
  }

  /// The finite primitives that light from infinity may cross lie within twice the reach of the boxes along each axis.
  [[nodiscard]] ConvexRegion region() const {
    const Bounds from = box_of(patch_.shadow_start);
    const double reach = bounds_.tree.reach();
    if (!directional_) return shaft(from, box_of(light_points(light_)), reach);
    const double length = 4 * (reach + std::max(largest_component(from.low), largest_component(from.high)));
    const Vec3 offset = light_.axis * length;
    return shaft(from, {from.low + offset, from.high + offset}, reach);
  }

  void gather() {
    const BoxTree& tree = bounds_.tree;
    if (tree.empty()) return;
    const ConvexRegion region = this->region();
    std::uint32_t stack[stack_size];
    int size = 0;
    stack[size++] = 0;
    while (size > 0 && !ended()) {
      const BoxTree::Node& node = tree.node(stack[--size]);
      for (unsigned mask = overlaps(node, region); mask != 0 && !ended(); mask &= mask - 1) {
        const std::uint32_t child = node.child[std::countr_zero(mask)];
        if (node.leaf) {
          add(tree.primitive(child));
        } else if (size == stack_size) {
          tests_ = tests_max + 1;
          overflows_ = true;
        } else {
          stack[size++] = child;
        }
      }
    }
  }

  [[nodiscard]] bool is_transmissive(const PrimitiveRef& primitive) const {
    const std::uint32_t number = primitive.geometry;
    switch (geometry_.kind_of(number)) {
      case GeometryKind::spheres:
        return geometry_.spheres[number].transmissive;
      case GeometryKind::triangles:
        return geometry_.mesh(number).transmissive;
      case GeometryKind::quadrics:
        return geometry_.quadric_set(number).transmissive;
      case GeometryKind::planes:
        break;
    }
    return geometry_.planes.transmissive[primitive.primitive] != 0;
  }

  void add(const PrimitiveRef& primitive) {
    const GeometryKind kind = geometry_.kind_of(primitive.geometry);
    const bool excluded = kind == GeometryKind::triangles || kind == GeometryKind::planes || patch_.convex;
    if (primitive == patch_.primitive && excluded) return;
    if (kind == GeometryKind::triangles && leaves_face_ && behind_face(primitive)) return;
    if (kind == GeometryKind::triangles && on_triangle_ && !patch_.offset && leaves_plane(primitive)) return;
    ++tests_;
    const bool transmissive = is_transmissive(primitive);
    const BundleHit hit = intersect(geometry_, primitive, rays_);
    if (hit.kind == BundleHit::Kind::miss) return;
    if (hit.kind == BundleHit::Kind::cover) {
      const Interval t = hit.t.range();
      if (!directional_ && t.low >= 1) return;
      // Shadow rays end 2^-40 of their length before the light.
      if (!transmissive && (directional_ || t.high < 1 - 0x1p-38)) {
        dark_ = true;
        return;
      }
    }
    if (found_ != nullptr) {
      overflows_ = static_cast<std::size_t>(partial_) == Occluders::primitives_max;
      if (!overflows_) found_->primitives[static_cast<std::size_t>(partial_)] = primitive;
    }
    ++partial_;
    transmissive_ |= transmissive;
  }

  /// A triangle is behind the patch's plane if its vertices are, up to the rounding of their heights; the offset of
  /// shadow rays covers that of shared vertices.
  [[nodiscard]] bool behind_face(const PrimitiveRef& primitive) const {
    const TriangleGeometry& mesh = geometry_.mesh(primitive.geometry);
    for (const std::uint32_t vertex : mesh.triangles[primitive.primitive]) {
      const Vec3 position = mesh.position(vertex), offset = position - patch_.anchor;
      const double rounding = (dot(abs(offset), abs(patch_.flat_normal)) + dot(abs(position), abs(patch_.flat_normal)) +
                               dot(abs(patch_.anchor), abs(patch_.flat_normal))) *
                              form_rounding;
      if (dot(offset, patch_.flat_normal) > rounding) return false;
    }
    return true;
  }

  /// True if the patch's triangle lies on the side of the other's plane that shadow rays move to.
  [[nodiscard]] bool leaves_plane(const PrimitiveRef& primitive) const {
    const PlaneOf plane = *plane_of(geometry_, primitive);
    const Interval rate = dot(rays_.direction, plane.normal).range();
    if (!(rate.low > 0) && !(rate.high < 0)) return false;
    const TriangleGeometry& own = geometry_.mesh(patch_.primitive.geometry);
    const TriangleGeometry& other = geometry_.mesh(primitive.geometry);
    const auto& [a, b, c] = other.triangles[primitive.primitive];
    const double edges = length(other.position(b) - plane.point) * length(other.position(c) - plane.point);
    for (const std::uint32_t vertex : own.triangles[patch_.primitive.primitive]) {
      const Vec3 position = own.position(vertex);
      const double height = dot(position - plane.point, plane.normal);
      const double rounding = (length(position) + 2 * length(plane.point)) * edges * form_rounding;
      if ((rate.low > 0 ? height : -height) < -rounding) return false;
    }
    return true;
  }

  const SceneBounds& bounds_;
  const GeometrySet& geometry_;
  const SurfacePatch& patch_;
  const CompiledLight& light_;
  Occluders* const found_;
  RayBundle rays_;
  bool directional_ = false, on_triangle_ = false, leaves_face_ = false;
  bool dark_ = false, transmissive_ = false, overflows_ = false;
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

Interval shadow_range(const SceneBounds& bounds, const SurfacePatch& patch, const CompiledLight& light,
                      const Occluders& known, Occluders* found) {
  using State = Occluders::State;
  if (found != nullptr) found->state = State::unknown;
  Interval range{0, bounds.transmittance_max};
  if (known.state == State::dark || known.state == State::lit) {
    range = known.state == State::lit ? Interval{1, 1} : Interval{0, 0};
  } else {
    ShadowShaft shaft(bounds, patch, light, found);
    if (shaft.is_behind()) {
      range = {0, 0};
    } else if (!light.shadows) {
      range = {bounds.approximate.any() ? 0.0 : 1.0, 1};
    } else if (!bounds.approximate.any() && patch.has_normal) {
      range = shaft.range(known);
    }
  }
  if (bounds.outside_absorbs && light.shadows) range.low = 0;
  if (found != nullptr && range.high == 0) found->state = State::dark;
  if (found != nullptr && range.low == 1 && range.high == 1) found->state = State::lit;
  return range;
}

}  // namespace tracer
