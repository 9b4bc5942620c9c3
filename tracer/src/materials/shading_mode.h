#pragma once
/// Shading mode of a surface.

#include "tracer/scene.h"

namespace tracer {

inline Material::Shading shading_of(Material::Shading own, Approximations::Shading approximate) {
  switch (approximate) {
    case Approximations::Shading::gouraud:
      return Material::Shading::gouraud;
    case Approximations::Shading::flat:
      return Material::Shading::flat;
    case Approximations::Shading::exact:
      break;
  }
  return own;
}

}  // namespace tracer
