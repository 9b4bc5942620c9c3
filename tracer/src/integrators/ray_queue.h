#pragma once
/// Rays of one kind waiting to be traced, as arrays. The order of a queue is the order of its samples' contributions,
/// so it must never depend on anything but the scene.

#include <algorithm>
#include <numeric>
#include <vector>

#include "tracer/src/accel/accelerator.h"
#include "tracer/src/interaction/ray_cone.h"
#include "tracer/src/math/compress.h"

namespace tracer {

class RayQueue {
 public:
  void push(const Vec3& origin, const Vec3& direction, const Color& throughput, std::uint32_t sample, PrimitiveRef from,
            std::uint32_t path, std::uint32_t media) {
    if (size_ == sample_.size()) grow(2 * size_);
    ox_[size_] = origin.x;
    oy_[size_] = origin.y;
    oz_[size_] = origin.z;
    dx_[size_] = direction.x;
    dy_[size_] = direction.y;
    dz_[size_] = direction.z;
    r_[size_] = throughput.r;
    g_[size_] = throughput.g;
    b_[size_] = throughput.b;
    sample_[size_] = sample;
    from_[size_] = from;
    path_[size_] = path;
    media_[size_] = media;
    ++size_;
  }

  /// Rays beside each other, to be appended; `path` null: all 0.
  struct Lanes {
    const double *ox, *oy, *oz, *dx, *dy, *dz, *r, *g, *b;
    const std::uint32_t* sample;
    const PrimitiveRef* from;
    const std::uint32_t *path, *media;
  };
  /// The lanes of the mask, in their order.
  void append(const Lanes& rays, LaneMask mask);

  void push(const RayQueue& other, std::size_t i) {
    push(other.origin(i), other.direction(i), other.throughput(i), other.sample_[i], other.from_[i], other.path_[i],
         other.media_[i]);
    if (!other.cone_.empty()) widen(other.cone_[i]);
  }

  /// Gives ray `i`, or the one pushed last, its cone. Queues in which no ray has one hold none.
  void widen(std::size_t i, const RayCone& cone) {
    if (cone_.size() < sample_.size()) cone_.resize(sample_.size());
    cone_[i] = cone;
  }
  void widen(const RayCone& cone) { widen(size_ - 1, cone); }

  /// Makes these `count` camera rays, one for each sample; where they start and go is to be written to what it returns.
  CompiledCamera::CameraRaySpan start_over(std::size_t count, std::uint32_t media) {
    if (sample_.size() < count) grow(count);
    size_ = count;
    for (auto* channel : {&r_, &g_, &b_}) std::fill_n(channel->begin(), count, 1.0);
    std::iota(sample_.begin(), sample_.begin() + static_cast<std::ptrdiff_t>(count), 0u);
    std::fill_n(from_.begin(), count, PrimitiveRef{});
    std::fill_n(path_.begin(), count, 0u);
    std::fill_n(media_.begin(), count, media);
    return {ox_.data(), oy_.data(), oz_.data(), dx_.data(), dy_.data(), dz_.data()};
  }

  /// Keeps the memory for the next rays.
  void clear() { size_ = 0; }

  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] bool empty() const { return size_ == 0; }
  [[nodiscard]] Vec3 origin(std::size_t i) const { return {ox_[i], oy_[i], oz_[i]}; }
  [[nodiscard]] Vec3 direction(std::size_t i) const { return {dx_[i], dy_[i], dz_[i]}; }
  [[nodiscard]] Color throughput(std::size_t i) const { return {r_[i], g_[i], b_[i]}; }
  [[nodiscard]] std::uint32_t sample(std::size_t i) const { return sample_[i]; }
  [[nodiscard]] PrimitiveRef from(std::size_t i) const { return from_[i]; }
  [[nodiscard]] std::uint32_t path(std::size_t i) const { return path_[i]; }
  [[nodiscard]] std::uint32_t media(std::size_t i) const { return media_[i]; }

  /// What shading gathers of many rays at once.
  struct Carried {
    const double *r, *g, *b;
    const std::uint32_t *sample, *path, *media;
  };
  [[nodiscard]] Carried carried() const {
    return {r_.data(), g_.data(), b_.data(), sample_.data(), path_.data(), media_.data()};
  }

  [[nodiscard]] const RayCone& cone(std::size_t i) const { return cone_[i]; }  ///< precondition: it was given one

  /// `t_max` null or one per ray.
  [[nodiscard]] RaySpan span(const double* t_max = nullptr) const {
    return {ox_.data(), oy_.data(), oz_.data(), dx_.data(), dy_.data(), dz_.data(), t_max, from_.data(), size_};
  }

 private:
  /// Rare. In line it would cost every push the registers that it saves.
  __attribute__((noinline)) void grow(std::size_t wanted) {
    const std::size_t capacity = std::max<std::size_t>(64, wanted);
    for (auto* component : {&ox_, &oy_, &oz_, &dx_, &dy_, &dz_, &r_, &g_, &b_}) component->resize(capacity);
    sample_.resize(capacity);
    from_.resize(capacity);
    path_.resize(capacity);
    media_.resize(capacity);
  }

  // Of equal length, the capacity; the first size_ are in use. One check then serves all.
  std::size_t size_ = 0;
  std::vector<double> ox_, oy_, oz_, dx_, dy_, dz_;
  std::vector<double> r_, g_, b_;      ///< throughput: what a unit of radiance along the ray adds to its sample
  std::vector<std::uint32_t> sample_;  ///< index in the batch
  std::vector<PrimitiveRef> from_;
  std::vector<std::uint32_t> path_;   ///< hash of the bounces that led here: random choices on different paths differ
  std::vector<std::uint32_t> media_;  ///< the solids it is inside of: a Media::List
  std::vector<RayCone> cone_;         ///< empty, or of equal length too
};

}  // namespace tracer
