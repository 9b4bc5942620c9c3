#pragma once
/// Rooms: opaque surfaces around the camera, which keep light between them.

#include "tracer/scene.h"

namespace tracer {

/// open: one of the six sides has no wall. A side of the bounds of everything finite has a wall if opaque faces along
/// it have nine tenths of its area, or if a plane lies on it or beyond it.
enum class Enclosure { none, open, closed };

/// The room that the camera looks into: from within, or through its open side. A sphere around the camera is a closed
/// room. No rays are traced. Precondition: validate() accepts the scene.
Enclosure enclosure_of_camera(const Scene& scene);

}  // namespace tracer
