#pragma once
/// Which solids a ray is inside of. Lists share their tails, so a ray carries one number however deep it is nested, and
/// a scene without solids that let light in carries zeros.

#include <algorithm>
#include <cstdint>
#include <vector>

#include "tracer/src/compiled_scene.h"

namespace tracer {

class Media {
 public:
  using List = std::uint32_t;
  static constexpr List outside = 0;
  static constexpr std::uint32_t nothing = 0xffffffffu;

  explicit Media(const CompiledScene& scene) : scene_(scene) { reset(); }

  /// Forgets all lists but the camera's.
  void reset() {
    nodes_.assign(1, {outside, nothing});
    List list = outside;
    for (const std::uint32_t object : scene_.objects_around_camera) list = enter(list, object);
  }
  /// The list of camera rays, in every Media of the scene.
  static List camera(const CompiledScene& scene) { return static_cast<List>(scene.objects_around_camera.size()); }

  [[nodiscard]] List enter(List list, std::uint32_t object) {
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

  /// The object whose substance is there: the highest priority, among equals the latest entered; or `nothing`.
  [[nodiscard]] std::uint32_t filling(List list) const {
    std::uint32_t best = nothing;
    for (; list != outside; list = nodes_[list].below) {
      const std::uint32_t object = nodes_[list].object;
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
    const std::uint32_t object = filling(list);
    if (object == nothing) return {1, 1, 1};
    const Color& a = scene_.material_of(object).absorption;
    const double s = scene_.frame.world_from_trace(distance);
    // 0 times an infinite length is no absorption, not NaN.
    const auto through = [s](double absorption) { return absorption > 0 ? std::exp(-absorption * s) : 1.0; };
    return {through(a.r), through(a.g), through(a.b)};
  }

 private:
  struct Node {
    List below;
    std::uint32_t object;
  };

  template <class Sought>
  [[nodiscard]] List latest(List list, const Sought& sought) const {
    while (list != outside && !sought(nodes_[list].object)) list = nodes_[list].below;
    return list;
  }

  /// What is above the removed one is entered again, in its order.
  [[nodiscard]] List without(List list, List removed) {
    std::vector<std::uint32_t> above;
    for (; list != removed; list = nodes_[list].below) above.push_back(nodes_[list].object);
    List result = nodes_[removed].below;
    std::reverse(above.begin(), above.end());
    for (const std::uint32_t object : above) result = enter(result, object);
    return result;
  }

  const CompiledScene& scene_;
  std::vector<Node> nodes_;  ///< nodes_[0] is the outside
};

}  // namespace tracer
