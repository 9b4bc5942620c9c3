#include "tracer/src/lights/light_tree.h"

#include <algorithm>
#include <numeric>

namespace tracer {
namespace {

Vec3 center_of(const Bounds& bounds) { return (bounds.low + bounds.high) * 0.5; }

double component(const Vec3& v, int axis) { return axis == 0 ? v.x : axis == 1 ? v.y : v.z; }

}  // namespace

LightTree::LightTree(std::span<const Lamp> lamps) : leaf_(lamps.size()) {
  if (lamps.empty()) return;
  std::vector<std::uint32_t> numbers(lamps.size());
  std::iota(numbers.begin(), numbers.end(), 0U);
  nodes_.reserve(2 * lamps.size() - 1);
  add(lamps, numbers, 0);
}

/// Divides the lamps at the median along the longest axis: the tree has the depth of a logarithm.
std::uint32_t LightTree::add(std::span<const Lamp> lamps, std::span<std::uint32_t> numbers, std::uint32_t parent) {
  Bounds box, centers;
  double power = 0;
  for (const std::uint32_t number : numbers) {
    box.include(lamps[number].bounds);
    centers.include(center_of(lamps[number].bounds));
    power += lamps[number].power;
  }
  const Vec3 half = (box.high - box.low) * 0.5;
  const auto node = static_cast<std::uint32_t>(nodes_.size());
  nodes_.push_back({center_of(box), dot(half, half), power, 0, numbers.front(), parent});
  if (numbers.size() == 1) {
    leaf_[numbers.front()] = node;
    return node;
  }
  const Vec3 size = centers.high - centers.low;
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  const std::size_t first = numbers.size() / 2;
  std::ranges::nth_element(
      numbers, numbers.begin() + static_cast<std::ptrdiff_t>(first), {},
      [&](std::uint32_t number) { return std::pair(component(center_of(lamps[number].bounds), axis), number); });
  add(lamps, numbers.first(first), node);
  const std::uint32_t second = add(lamps, numbers.subspan(first), node);
  nodes_[node].second = second;
  return node;
}

double LightTree::irradiance(const Node& node, const Vec3& from) {
  const Vec3 offset = node.center - from;
  return node.power / std::max(dot(offset, offset), node.squared_radius);
}

double share_of(double power, double other) {
  const double share = power / (power + other);
  return share > 0 && share < 1 ? share : 0.5;
}

double LightTree::share_of_first(const Node& node, const Vec3& from) const {
  return share_of(irradiance(*(&node + 1), from), irradiance(nodes_[node.second], from));
}

Selected LightTree::select(const Vec3& from, double xi) const {
  const Node* node = nodes_.data();
  double probability = 1;
  while (node->second != 0) {
    const double share = share_of_first(*node, from);
    const bool first = xi < share;
    xi = first ? xi / share : (xi - share) / (1 - share);
    probability *= first ? share : 1 - share;
    node = first ? node + 1 : &nodes_[node->second];
  }
  return {node->lamp, std::clamp(xi, 0.0, 1.0), probability};
}

double LightTree::probability(const Vec3& from, std::size_t lamp) const {
  double probability = 1;
  for (std::uint32_t node = leaf_[lamp]; node != 0; node = nodes_[node].parent) {
    const Node& parent = nodes_[nodes_[node].parent];
    const double share = share_of_first(parent, from);
    probability *= node == parent.second ? 1 - share : share;
  }
  return probability;
}

}  // namespace tracer
