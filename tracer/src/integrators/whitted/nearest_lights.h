#pragma once
/// Which lights are the nearest of a hit, where only so many of them count.

#include <algorithm>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "tracer/src/lights/registry.h"
#include "tracer/src/math/vec.h"

namespace tracer {

class NearestLights {
 public:
  /// Chooses `wanted` lights, at least one, for each hit. Directional ones are everywhere: they are not among those
  /// counted. A soft light is where its middle is; of two at equal distance the first of the scene is nearer.
  void choose(const std::vector<CompiledLight>& lights, const std::vector<Vec3>& hits, std::uint32_t wanted) {
    directional_.clear();
    for (const CompiledLight& light : lights)
      directional_.push_back(light.kind == light_kind<DirectionalLight> ? 1 : 0);
    middles_.clear();
    for (const CompiledLight& light : lights) middles_.push_back(light_center(light));
    position_ = hits;
    farthest_.clear();
    for (const Vec3& position : position_) farthest_.push_back(farthest(position, wanted));
  }

  /// Whether the light is one of those.
  [[nodiscard]] bool count(std::size_t hit, std::uint32_t number) const {
    return directional_[number] != 0 || rank(position_[hit], number) <= farthest_[hit];
  }

 private:
  using Rank = std::pair<double, std::uint32_t>;  ///< by squared distance, then by number

  [[nodiscard]] Rank rank(const Vec3& position, std::uint32_t number) const {
    const Vec3 offset = middles_[number] - position;
    return {dot(offset, offset), number};
  }

  Rank farthest(const Vec3& position, std::uint32_t wanted) {
    ranks_.clear();
    for (std::uint32_t number = 0; number < middles_.size(); ++number)
      if (directional_[number] == 0) ranks_.push_back(rank(position, number));
    if (ranks_.size() <= wanted)
      return {std::numeric_limits<double>::infinity(), std::numeric_limits<std::uint32_t>::max()};
    const auto last = ranks_.begin() + (wanted - 1);
    std::nth_element(ranks_.begin(), last, ranks_.end());
    return *last;
  }

  std::vector<std::uint8_t> directional_;  ///< beside the lights
  std::vector<Vec3> middles_;              ///< likewise
  std::vector<Vec3> position_;             ///< of the hits
  std::vector<Rank> farthest_;             ///< of the lights that count, beside the hits
  std::vector<Rank> ranks_;
};

}  // namespace tracer
