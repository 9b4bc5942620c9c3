#include "tracer/src/cameras/compiled_camera.h"
#include "tracer/src/math/lanes.h"

namespace tracer {
namespace {

/// Directions of a perspective camera, with the arithmetic of generate_ray in the same order.
struct Window {
  Vec3 forward, right, up;
  double left, top, pixel;
};

WHITTLE_WIDE void rays_through_lens(const Window& w, const double* x, const double* y, std::size_t count, double* dx,
                                    double* dy, double* dz) {
  const Vec3 forward = w.forward, right = w.right, up = w.up;
  const double left = w.left, top = w.top, pixel = w.pixel;
  for (std::size_t i = 0; i < count; ++i) {
    const double across = (left + x[i]) * pixel, above = (top - y[i]) * pixel;
    const double ax = forward.x + right.x * across + up.x * above;
    const double ay = forward.y + right.y * across + up.y * above;
    const double az = forward.z + right.z * across + up.z * above;
    const double scale = 1 / std::sqrt(ax * ax + ay * ay + az * az);
    dx[i] = ax * scale;
    dy[i] = ay * scale;
    dz[i] = az * scale;
  }
}

}  // namespace

void CompiledCamera::generate_rays(const double* x, const double* y, std::size_t count, const CameraRaySpan& to,
                                   std::size_t eye) const {
  if (type_ != Camera::Type::perspective || layout_ == Camera::Layout::side_by_side) {
    for (std::size_t i = 0; i < count; ++i) to.put(i, generate_ray(x[i], y[i], eye));
    return;
  }
  const Eye& at = eyes_[eye];
  std::fill_n(to.ox, count, at.position.x);
  std::fill_n(to.oy, count, at.position.y);
  std::fill_n(to.oz, count, at.position.z);
  rays_through_lens({at.axis, right_, up_, left_, top_, pixel_}, x, y, count, to.dx, to.dy, to.dz);
}

}  // namespace tracer
