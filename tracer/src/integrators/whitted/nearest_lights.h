#pragma once
/// Selects the nearest lights of each hit.

#include <algorithm>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "tracer/src/lights/light_registry.h"
#include "tracer/src/math/vec.h"

namespace tracer {

class NearestLights {
 public:
  /// Selects `count` >= 1 lights for each hit, by the distance of their centers, then by their order in the scene.
  /// Directional lights are always included and not counted.
  void choose(const std::vector<CompiledLight>& lights, const std::vector<Vec3>& hits, std::uint32_t count) {
    is_directional_.clear();
    centers_.clear();
    for (const CompiledLight& light : lights) {
      is_directional_.push_back(light.kind == light_kind<DirectionalLight> ? 1 : 0);
      centers_.push_back(light_center(light));
    }
    position_ = hits;
    last_rank_.clear();
    for (const Vec3& position : position_) last_rank_.push_back(last_rank(position, count));
  }

  [[nodiscard]] bool includes(std::size_t hit, std::uint32_t number) const {
    return is_directional_[number] != 0 || rank(position_[hit], number) <= last_rank_[hit];
  }

 private:
  using Rank = std::pair<double, std::uint32_t>;  ///< squared distance, then number of the light

  [[nodiscard]] Rank rank(const Vec3& position, std::uint32_t number) const {
    const Vec3 offset = centers_[number] - position;
    return {dot(offset, offset), number};
  }

  Rank last_rank(const Vec3& position, std::uint32_t count) {
    ranks_.clear();
    for (std::uint32_t number = 0; number < centers_.size(); ++number)
      if (is_directional_[number] == 0) ranks_.push_back(rank(position, number));
    if (ranks_.size() <= count)
      return {std::numeric_limits<double>::infinity(), std::numeric_limits<std::uint32_t>::max()};
    const auto last = ranks_.begin() + (count - 1);
    std::nth_element(ranks_.begin(), last, ranks_.end());
    return *last;
  }

  std::vector<std::uint8_t> is_directional_;  ///< by light
  std::vector<Vec3> centers_;                 ///< by light
  std::vector<Vec3> position_;                ///< by hit
  std::vector<Rank> last_rank_;               ///< rank of the farthest included light, by hit
  std::vector<Rank> ranks_;
};

}  // namespace tracer
