#pragma once
/// Queues of rays waiting to be traced, their cones and their intersections.

#include <algorithm>
#include <memory>
#include <numeric>
#include <utility>
#include <vector>

#include "tracer/src/accel/accelerator.h"
#include "tracer/src/compiled/compiled_scene.h"
#include "tracer/src/interaction/surface.h"
#include "tracer/src/math/lanes.h"

namespace tracer {

/// Footprint of a sample, propagated along the path to filter textures: a beam of square section (Amanatides 1984, "Ray
/// Tracing with Cones"; Akenine-Moeller, Nilsson, Andersson, Barre-Brisebois, Toth, Karras 2019, Ray Tracing Gems, ch.
/// 20).
struct RayCone {
  double width = 0;   ///< side length at the origin, render space; may be negative before a focus
  double spread = 0;  ///< growth of the side per unit of length, a small angle

  [[nodiscard]] double width_at(double distance) const { return std::abs(width + spread * distance); }
};

/// Cone of a sample that covers the fraction `share` of its pixel's width. The samples of a pixel cover it once
/// together, so that the mean over the pixel does not depend on their number.
inline RayCone camera_cone(const CompiledScene& scene, const Vec3& direction, double share) {
  const CompiledCamera::Footprint pixel = scene.camera.pixel_footprint(direction);
  return {pixel.width * share, pixel.spread * share};
}

/// After reflection at distance `t` with `curvature` on the incident side: the edges of the cone turn by twice the
/// angle between their normals (Ray Tracing Gems, ch. 20.3.4).
inline RayCone reflected_cone(const RayCone& cone, double t, double curvature) {
  const double width = cone.width + cone.spread * t;
  return {width, cone.spread + 2 * curvature * width};
}

/// After refraction with `n` = n_from / n_to, by Snell's law for small angles.
inline RayCone refracted_cone(const RayCone& cone, double t, double curvature, double n) {
  const double width = cone.width + cone.spread * t;
  return {width, cone.spread * n + (n - 1) * curvature * width};
}

/// State of a ray beside its throughput where surfaces reflect the light of surfaces, or are principled.
struct PathState {
  /// Largest channel of the throughput at the first diffuse bounce; 0: there was none yet.
  double weight = 0;
  /// Density of the direction of a diffuse ray, per solid angle, if emitters are sampled as well; else 0.
  double density = 0;
  /// For a ray toward an emitter, which brings the emission of this primitive alone; no hit: that of the sky. With a
  /// density: that of every emitter which is sampled.
  PrimitiveRef emitter{};
  /// Width of the roughest surface on the way, for PrincipledSurface::highlight.
  double alpha = 0;
};

/// Rays of one kind, as arrays. Their order is the order of the contributions to a sample, so it must depend on the
/// scene only.
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

  /// A packet of rays to append. If `path` is null, all paths are 0; if `throughput` is null, it is undefined.
  struct Lanes {
    const VecLanes &origin, &direction;
    const ColorLanes* throughput;
    const std::uint32_t* sample;
    const PrimitiveRef* from;
    const std::uint32_t *path, *media;
  };
  /// Appends the lanes of the mask, in their order.
  void append(const Lanes& rays, LaneMask mask);

  void push(const RayQueue& other, std::size_t i) {
    push(other.origin(i), other.direction(i), other.throughput(i), other.sample_[i], other.from_[i], other.path_[i],
         other.media_[i]);
    if (!other.cone_.empty()) set_cone(other.cone_[i]);
    if (!other.path_state_.empty()) set_path_state(size_ - 1, other.path_state_[i]);
  }

  /// Sets the cone of ray `i`, or of the last ray. A queue without cones stores none.
  void set_cone(std::size_t i, const RayCone& cone) {
    if (cone_.size() < sample_.size()) cone_.resize(sample_.size());
    cone_[i] = cone;
  }
  void set_cone(const RayCone& cone) { set_cone(size_ - 1, cone); }

  /// Sets the state of ray `i`. A queue without states stores none.
  void set_path_state(std::size_t i, const PathState& state) {
    if (path_state_.size() < sample_.size()) path_state_.resize(sample_.size());
    path_state_[i] = state;
  }

  /// Resets the queue to `count` camera rays, one for each of as many samples. The caller writes origins and directions
  /// to the result.
  CompiledCamera::CameraRaySpan reset_to_camera_rays(std::size_t count, std::uint32_t media) {
    if (sample_.size() < count) grow(count);
    size_ = count;
    for (auto* channel : {&r_, &g_, &b_}) std::fill_n(channel->begin(), count, 1.0);
    std::iota(sample_.begin(), sample_.begin() + static_cast<std::ptrdiff_t>(count), 0u);
    std::fill_n(from_.begin(), count, PrimitiveRef{});
    std::fill_n(path_.begin(), count, 0u);
    std::fill_n(media_.begin(), count, media);
    return {ox_.data(), oy_.data(), oz_.data(), dx_.data(), dy_.data(), dz_.data()};
  }

  /// The first half of the camera rays keeps red. The second half has the same samples and keeps green and blue.
  void split_channels() {
    const std::size_t half = size_ / 2;
    for (std::size_t i = 0; i < half; ++i) {
      g_[i] = b_[i] = r_[half + i] = 0;
      sample_[half + i] = sample_[i];
    }
  }

  /// Empties the queue and keeps its memory.
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

  /// The arrays that packets are gathered from.
  struct Payload {
    const double *r, *g, *b;
    const std::uint32_t *sample, *path, *media;
  };
  [[nodiscard]] Payload payload() const {
    return {r_.data(), g_.data(), b_.data(), sample_.data(), path_.data(), media_.data()};
  }

  /// Precondition: set_cone() was called for the ray.
  [[nodiscard]] const RayCone& cone(std::size_t i) const { return cone_[i]; }

  /// That of a camera ray in a queue without states. Precondition: set_path_state() was called for the ray or for none.
  [[nodiscard]] PathState path_state(std::size_t i) const { return path_state_.empty() ? PathState() : path_state_[i]; }

  /// `t_max`: null, or one value per ray.
  [[nodiscard]] RaySpan span(const double* t_max = nullptr) const {
    return {ox_.data(), oy_.data(), oz_.data(), dx_.data(), dy_.data(), dz_.data(), t_max, from_.data(), size_};
  }

 private:
  /// noinline: the growth path is rare and inlining it makes push() spill registers.
  __attribute__((noinline)) void grow(std::size_t count) {
    const std::size_t capacity = std::max<std::size_t>(64, count);
    for (auto* component : {&ox_, &oy_, &oz_, &dx_, &dy_, &dz_, &r_, &g_, &b_}) component->resize(capacity);
    sample_.resize(capacity);
    from_.resize(capacity);
    path_.resize(capacity);
    media_.resize(capacity);
  }

  // Vectors of equal length; the first size_ elements are in use. One capacity check serves all.
  std::size_t size_ = 0;
  std::vector<double> ox_, oy_, oz_, dx_, dy_, dz_;
  std::vector<double> r_, g_, b_;      ///< throughput: radiance added to the sample per unit of radiance along the ray
  std::vector<std::uint32_t> sample_;  ///< index in the batch
  std::vector<PrimitiveRef> from_;
  std::vector<std::uint32_t> path_;    ///< hash of the bounces so far: random choices on different paths differ
  std::vector<std::uint32_t> media_;   ///< MediumStack::List of the solids that enclose the origin
  std::vector<RayCone> cone_;          ///< empty, or of equal length
  std::vector<PathState> path_state_;  ///< empty, or of equal length
};

/// One intersection per ray, in arrays.
struct Hits {
  std::vector<PrimitiveRef> primitive;
  std::vector<double> t, u, v;

  /// Never shrinks: elements added to a vector are initialized first.
  HitSpan resize_to_fit(std::size_t count) {
    if (primitive.size() < count) {
      primitive.resize(count);
      for (auto* values : {&t, &u, &v}) values->resize(count);
    }
    return span();
  }
  [[nodiscard]] HitSpan span() { return {primitive.data(), t.data(), u.data(), v.data()}; }
  [[nodiscard]] Hit at(std::size_t i) const { return {primitive[i], t[i], u[i], v[i]}; }
};

/// Rays of one depth, by kind.
struct BounceQueues {
  RayQueue camera, reflection, refraction;
  RayQueue diffuse;         ///< in the directions of the cosine
  RayQueue emission;        ///< toward emitters
  std::uint32_t depth = 0;  ///< 0: camera rays
  void clear() {
    for (RayQueue* queue : {&camera, &reflection, &refraction, &diffuse, &emission}) queue->clear();
  }
  [[nodiscard]] std::size_t size() const {
    return camera.size() + reflection.size() + refraction.size() + diffuse.size() + emission.size();
  }
};

using BounceQueuesPtr = std::unique_ptr<BounceQueues>;  ///< moved once per bounce: the queues are many arrays

/// A larger bounce is split, and its first part traced to the end before the second: memory grows with the depth, not
/// with the number of rays.
inline constexpr std::size_t bounce_rays_max = 16384;

/// Splits a bounce by samples; one with a single sample, by the order of its rays. The position of that split depends
/// on the sample alone: samples that share a bounce are separated first.
std::pair<BounceQueuesPtr, BounceQueuesPtr> split(const BounceQueues& bounce);

}  // namespace tracer
