#pragma once
/// Which solids a ray is inside of. Lists share their tails, so a ray carries one number however deep it is nested, and
/// a scene without solids that let light in carries zeros.

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

  /// A surface on the way of a ray.
  struct Crossing {
    List after = outside;                         ///< the list beyond it
    std::uint32_t near = nothing, far = nothing;  ///< objects that fill the place on this side of it and on the other
    bool hidden = false;  ///< nothing is met: what hides within a solid of higher priority is not there
  };

  explicit MediumStack(const CompiledScene& scene) : scene_(scene) { reset(); }

  /// Forgets all lists but the camera's.
  void reset() {
    nodes_.assign(1, {outside, nothing});
    List list = outside;
    for (const std::uint32_t object : scene_.media_enclosing_camera) list = enter(list, object);
  }
  /// The list of camera rays, in every Media of the scene: each object but the outermost has a node.
  static List camera(const CompiledScene& scene) {
    const auto& enclosing = scene.media_enclosing_camera;
    return enclosing.size() == 1 ? alone(enclosing[0])
                                 : static_cast<List>(std::max<std::size_t>(enclosing.size(), 1) - 1);
  }

  /// Through a surface of `object`, which is met from behind or not.
  [[nodiscard]] Crossing cross(List before, std::uint32_t object, bool back) {
    // Nearly all are of one solid at a time.
    if (!back && before == outside) return {alone(object), nothing, object, false};
    if (back && before == alone(object)) return {outside, object, nothing, false};
    const List after = back ? leave(before, object) : enter(before, object);
    const std::uint32_t near = current_medium(before), far = current_medium(after);
    return {after, near, far, after != before && near == far};
  }

  /// The object whose substance is there: the highest priority, among equals the latest entered; or `nothing`.
  [[nodiscard]] std::uint32_t current_medium(List list) const {
    std::uint32_t best = nothing;
    for (; list != outside; list = node(list).below) {
      const std::uint32_t object = node(list).object;
      if (best == nothing || scene_.material_of(object).priority > scene_.material_of(best).priority) best = object;
    }
    return best;
  }

  /// Refractive index of what fills the place. Solids that let light straight on do not bend it.
  [[nodiscard]] double ior(std::uint32_t filling_object) const {
    if (filling_object == nothing) return 1;
    const Material& material = scene_.material_of(filling_object);
    return material.transparency == Material::Transparency::refract ? material.ior : 1;
  }

  /// exp(-absorption s) over `distance` in the trace frame (Lambert 1760).
  [[nodiscard]] Color transmittance(List list, double distance) const {
    const std::uint32_t object = current_medium(list);
    if (object == nothing) return {1, 1, 1};
    const Color& a = scene_.material_of(object).absorption;
    const double s = scene_.frame.world_from_render(distance);
    // 0 times an infinite length is no absorption, not NaN.
    const auto through = [s](double absorption) { return absorption > 0 ? std::exp(-absorption * s) : 1.0; };
    return {through(a.r), through(a.g), through(a.b)};
  }

 private:
  struct Node {
    List below;
    std::uint32_t object;
  };

  /// The list of one object alone needs no node: it is the object.
  static constexpr List alone_bit = 0x80000000u;
  static constexpr List alone(std::uint32_t object) { return object | alone_bit; }
  [[nodiscard]] Node node(List list) const {
    return (list & alone_bit) != 0 ? Node{outside, list & ~alone_bit} : nodes_[list];
  }

  [[nodiscard]] List enter(List list, std::uint32_t object) {
    if (list == outside) return alone(object);
    nodes_.push_back({list, object});
    return static_cast<List>(nodes_.size() - 1);
  }

  /// Without the latest entry of `object`; of one that was never entered, without the latest of its material: a hollow
  /// may be another object, turned inside out, of the same glass. The same list when there is neither (a surface
  /// without an inside).
  [[nodiscard]] List leave(List list, std::uint32_t object) {
    const std::uint32_t material = scene_.material_of_object[object];
    if (const List place = latest(list, [&](std::uint32_t other) { return other == object; }))
      return without(list, place);
    if (const List place =
            latest(list, [&](std::uint32_t other) { return scene_.material_of_object[other] == material; }))
      return without(list, place);
    return list;
  }

  template <class Sought>
  [[nodiscard]] List latest(List list, const Sought& sought) const {
    while (list != outside && !sought(node(list).object)) list = node(list).below;
    return list;
  }

  /// What is above the removed one is entered again, in its order.
  [[nodiscard]] List without(List list, List removed) {
    std::vector<std::uint32_t> above;
    for (; list != removed; list = node(list).below) above.push_back(node(list).object);
    List result = node(removed).below;
    std::reverse(above.begin(), above.end());
    for (const std::uint32_t object : above) result = enter(result, object);
    return result;
  }

  const CompiledScene& scene_;
  std::vector<Node> nodes_;  ///< nodes_[0] is the outside
};

}  // namespace tracer
