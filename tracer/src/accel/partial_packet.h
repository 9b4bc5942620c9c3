#pragma once
/// The rays of a span that fill no packet, made up to one by rays that meet nothing.

#include <algorithm>
#include <limits>

#include "tracer/src/accel/accelerator.h"
#include "tracer/src/math/wide.h"

namespace tracer {

class PartialPacket {
 public:
  /// Those from `first` on. Precondition: at least one and less than a packet of them.
  PartialPacket(const RaySpan& rays, std::size_t first)
      : count_(rays.count - first), has_end_(rays.t_max != nullptr), has_from_(rays.from != nullptr) {
    const double* components[] = {rays.ox, rays.oy, rays.oz, rays.dx, rays.dy, rays.dz, rays.t_max};
    for (int k = 0; k < (has_end_ ? 7 : 6); ++k) {
      std::copy_n(components[k] + first, count_, values_[k]);
      std::fill(values_[k] + count_, values_[k] + lanes, std::numeric_limits<double>::quiet_NaN());
    }
    if (has_from_) std::copy_n(rays.from + first, count_, from_);
  }

  [[nodiscard]] RaySpan rays() const {
    return {values_[0],
            values_[1],
            values_[2],
            values_[3],
            values_[4],
            values_[5],
            has_end_ ? values_[6] : nullptr,
            has_from_ ? from_ : nullptr,
            lanes};
  }

  /// Where their answers go, and from there to hits[first...].
  [[nodiscard]] HitSpan hits() { return {primitive_, t_, u_, v_}; }
  void write(const HitSpan& hits, std::size_t first) const {
    std::copy_n(primitive_, count_, hits.primitive + first);
    std::copy_n(t_, count_, hits.t + first);
    std::copy_n(u_, count_, hits.u + first);
    std::copy_n(v_, count_, hits.v + first);
  }

 private:
  std::size_t count_;
  bool has_end_, has_from_;
  double values_[7][lanes];
  PrimitiveRef from_[lanes];
  PrimitiveRef primitive_[lanes];
  double t_[lanes], u_[lanes], v_[lanes];
};

}  // namespace tracer
