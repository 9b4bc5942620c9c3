#pragma once
/// Rays of one kind waiting to be traced, as arrays. The order of a queue is the order of its samples' contributions,
/// so it must never depend on anything but the scene.

#include <vector>

#include "tracer/src/accel/accelerator.h"

namespace tracer {

class RayQueue {
 public:
  void push(const Vec3& origin, const Vec3& direction, const Color& weight, std::uint32_t sample, PrimitiveRef from) {
    ox_.push_back(origin.x);
    oy_.push_back(origin.y);
    oz_.push_back(origin.z);
    dx_.push_back(direction.x);
    dy_.push_back(direction.y);
    dz_.push_back(direction.z);
    weight_.push_back(weight);
    sample_.push_back(sample);
    from_.push_back(from);
  }

  void push(const RayQueue& other, std::size_t i) {
    push(other.origin(i), other.direction(i), other.weight_[i], other.sample_[i], other.from_[i]);
  }

  void clear() {
    ox_.clear();
    oy_.clear();
    oz_.clear();
    dx_.clear();
    dy_.clear();
    dz_.clear();
    weight_.clear();
    sample_.clear();
    from_.clear();
  }

  [[nodiscard]] std::size_t size() const { return ox_.size(); }
  [[nodiscard]] bool empty() const { return ox_.empty(); }
  [[nodiscard]] Vec3 origin(std::size_t i) const { return {ox_[i], oy_[i], oz_[i]}; }
  [[nodiscard]] Vec3 direction(std::size_t i) const { return {dx_[i], dy_[i], dz_[i]}; }
  [[nodiscard]] const Color& weight(std::size_t i) const { return weight_[i]; }
  [[nodiscard]] std::uint32_t sample(std::size_t i) const { return sample_[i]; }

  /// `t_max` null or one per ray.
  [[nodiscard]] RaySpan span(const double* t_max = nullptr) const {
    return {ox_.data(), oy_.data(), oz_.data(), dx_.data(), dy_.data(), dz_.data(), t_max, from_.data(), size()};
  }

 private:
  std::vector<double> ox_, oy_, oz_, dx_, dy_, dz_;
  std::vector<Color> weight_;          ///< throughput: what a unit of radiance along the ray adds to its sample
  std::vector<std::uint32_t> sample_;  ///< index in the batch
  std::vector<PrimitiveRef> from_;
};

}  // namespace tracer
