#pragma once
/// Surfaces that separate media.

#include <cstdint>

#include "tracer/scene.h"

namespace tracer {

/// A ray that passes the front of a surface stays in its medium (none), enters the medium of the material, which
/// encloses no volume and hides no other surface (open), or enters a solid (closed).
enum class MediumBoundary : std::uint8_t { none, open, closed };

/// The boundary that `shape` is with this material: `closed` if it encloses a volume that refracts or absorbs, `open`
/// if it is a surface with a border that refracts. Light passes straight through `filtered` and `interpolated`
/// materials: they have a medium only where a volume absorbs. A mesh is closed if each edge has as many triangles in
/// one direction as in the other, corners at equal positions being one. Takes time in proportion to the triangles.
MediumBoundary medium_boundary(const Shape& shape, const Material& material);

}  // namespace tracer
