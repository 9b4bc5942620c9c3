#pragma once
/// How a surface of a material is shaded.

#include "tracer/scene.h"

namespace tracer {

inline Material::Shading shading_of(const Material& material, Approximations::Shading approximate) {
  switch (approximate) {
    case Approximations::Shading::gouraud:
      return Material::Shading::gouraud;
    case Approximations::Shading::flat:
      return Material::Shading::flat;
    case Approximations::Shading::exact:
      break;
  }
  return material.shading;
}

}  // namespace tracer
