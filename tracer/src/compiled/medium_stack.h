#pragma once
/// Stacks of the transmissive solids that enclose a ray. Lists share their tails, so that a ray carries one number for
/// any nesting depth, and 0 in a scene without such solids.

#include <algorithm>
#include <cstdint>
#include <vector>

#include "tracer/src/compiled/compiled_scene.h"

namespace tracer {

class MediumStack {
 public:
  using List = std::uint32_t;
  static constexpr List outside = 0;
  static constexpr std::uint32_t nothing = 0xffffffffu;

  /// A ray passing through a surface.
  struct Crossing {
    List after = outside;                         ///< list behind the surface
    std::uint32_t near = nothing, far = nothing;  ///< media on the incident and the other side
    bool hidden = false;     ///< nested boundary within a solid of higher priority: no effect on the ray
    bool unentered = false;  ///< leaves a medium that the ray never entered
  };

  explicit MediumStack(const CompiledScene& scene)
      : scene_(scene), outside_absorbs_(!(scene.media.outside.absorption == Color{})) {
    reset();
  }

  /// Discards all lists except the camera's.
  void reset() {
    nodes_.assign(1, {outside, nothing});
    List list = outside;
    for (const std::uint32_t object : scene_.media.enclosing_camera) list = enter(list, object);
  }
  /// List of camera rays, equal in every MediumStack of the scene: each object except the outermost has a node.
  static List camera(const CompiledScene& scene) {
    const auto& enclosing = scene.media.enclosing_camera;
    return enclosing.size() == 1 ? alone(enclosing[0])
                                 : static_cast<List>(std::max<std::size_t>(enclosing.size(), 1) - 1);
  }

  /// Crosses a surface of `object`; `back`: at a back-face hit.
  [[nodiscard]] Crossing cross(List before, std::uint32_t object, bool back) {
    const MediumBoundary boundary = scene_.objects.boundary[object];
    if (boundary == MediumBoundary::none) {
      const std::uint32_t medium = current_medium(before);
      return {before, medium, medium};
    }
    // Fast path: one solid at a time.
    if (!back && before == outside) return {alone(object), nothing, object};
    if (back && before == alone(object)) return {outside, object, nothing};
    const List after = back ? leave(before, object) : enter(before, object);
    const std::uint32_t near = current_medium(before), far = current_medium(after);
    if (after == before) return {after, near, far, false, true};
    // Only solids hide boundaries, and those of open surfaces only by a higher priority.
    const bool hidden = near == far && scene_.objects.boundary[near] == MediumBoundary::closed &&
                        (boundary == MediumBoundary::closed || priority(near) > priority(object));
    return {after, near, far, hidden};
  }

  /// The object of the list that fills the overlap of all, or `nothing`. It does not depend on the order in which they
  /// were entered, so light takes the same path in both directions.
  [[nodiscard]] std::uint32_t current_medium(List list) const {
    std::uint32_t best = nothing;
    for (; list != outside; list = node(list).below)
      if (best == nothing || displaces(node(list).object, best)) best = node(list).object;
    return best;
  }

  /// Refractive index of a medium; 1 unless it refracts.
  [[nodiscard]] double ior(std::uint32_t medium) const {
    if (medium == nothing) return 1;
    const Material& material = scene_.material_of(medium);
    return material.transparency == Material::Transparency::refract ? material.ior : 1;
  }

  /// exp(-absorption s) over `distance` in render space (Lambert 1760).
  [[nodiscard]] Color transmittance(List list, double distance) const {
    if (list == outside && !outside_absorbs_) return {1, 1, 1};
    const Color& a =
        list == outside ? scene_.media.outside.absorption : scene_.material_of(current_medium(list)).absorption;
    const double s = scene_.frame.world_from_render(distance);
    // Avoids 0 times infinity.
    const auto through = [s](double absorption) { return absorption > 0 ? std::exp(-absorption * s) : 1.0; };
    return {through(a.r), through(a.g), through(a.b)};
  }

 private:
  struct Node {
    List below;
    std::uint32_t object;
  };

  /// A list of one object is the object itself, without a node.
  static constexpr List alone_bit = 0x80000000u;
  static constexpr List alone(std::uint32_t object) { return object | alone_bit; }
  [[nodiscard]] Node node(List list) const {
    return (list & alone_bit) != 0 ? Node{outside, list & ~alone_bit} : nodes_[list];
  }

  [[nodiscard]] int priority(std::uint32_t object) const { return scene_.material_of(object).priority; }

  /// By priority, then solids before open surfaces, then the smaller object, which may be nested in the other, then the
  /// later material: not by the order of objects, which must not change the image.
  [[nodiscard]] bool displaces(std::uint32_t object, std::uint32_t other) const {
    if (priority(object) != priority(other)) return priority(object) > priority(other);
    const std::vector<MediumBoundary>& boundary = scene_.objects.boundary;
    if (boundary[object] != boundary[other]) return boundary[object] == MediumBoundary::closed;
    const std::vector<float>& diagonal = scene_.objects.diagonal;
    if (diagonal[object] != diagonal[other]) return diagonal[object] < diagonal[other];
    const std::vector<std::uint32_t>& material = scene_.objects.material;
    return material[object] != material[other] ? material[object] > material[other] : object > other;
  }

  [[nodiscard]] List enter(List list, std::uint32_t object) {
    if (list == outside) return alone(object);
    nodes_.push_back({list, object});
    return static_cast<List>(nodes_.size() - 1);
  }

  /// Removes the last entry of `object`, or else of its material: a cavity may be another, inverted object of the same
  /// glass. Returns the same list if there is neither (an open surface).
  [[nodiscard]] List leave(List list, std::uint32_t object) {
    const std::uint32_t material = scene_.objects.material[object];
    if (const List place = latest(list, [&](std::uint32_t other) { return other == object; }))
      return without(list, place);
    if (const List place =
            latest(list, [&](std::uint32_t other) { return scene_.objects.material[other] == material; }))
      return without(list, place);
    return list;
  }

  template <class Sought>
  [[nodiscard]] List latest(List list, const Sought& sought) const {
    while (list != outside && !sought(node(list).object)) list = node(list).below;
    return list;
  }

  /// The objects above the removed one are entered again, in order.
  [[nodiscard]] List without(List list, List removed) {
    std::vector<std::uint32_t> above;
    for (; list != removed; list = node(list).below) above.push_back(node(list).object);
    List result = node(removed).below;
    std::reverse(above.begin(), above.end());
    for (const std::uint32_t object : above) result = enter(result, object);
    return result;
  }

  const CompiledScene& scene_;
  const bool outside_absorbs_;
  std::vector<Node> nodes_;  ///< nodes_[0]: outside
};

}  // namespace tracer
