#pragma once
/// Unoccluded direct lighting of one light at 16 shading points.

#include "tracer/src/interaction/shading_points.h"
#include "tracer/src/lights/registry.h"
#include "tracer/src/math/compress.h"

namespace tracer {

/// Lane by lane with a ShadingPointPacket. From `highlight` on undefined if no lane is lit.
struct alignas(64) LightSamplePacket {
  double from_x[lanes], from_y[lanes], from_z[lanes];  ///< input: points of the light, unless it is directional

  double to_x[lanes], to_y[lanes], to_z[lanes];              ///< unit, towards the light
  double distance[lanes];                                    ///< render space; infinite for directional lights
  double cosine[lanes];                                      ///< N.L
  double strength[lanes];                                    ///< `share` after attenuation and the spot's cone
  double highlight[lanes];                                   ///< specular cosine, then its power
  double origin_x[lanes], origin_y[lanes], origin_z[lanes];  ///< origin of the shadow ray
  double r[lanes], g[lanes], b[lanes];                       ///< radiance added to the sample if not occluded

  LaneMask lit;  ///< lanes that receive light

  [[nodiscard]] Vec3 to_light(int i) const { return {to_x[i], to_y[i], to_z[i]}; }
  [[nodiscard]] Vec3 origin(int i) const { return {origin_x[i], origin_y[i], origin_z[i]}; }
  [[nodiscard]] Color color(int i) const { return {r[i], g[i], b[i]}; }
};

/// Evaluates the fraction `share` of `light`. `world_per_render` converts render-space distances to world space.
void sample_light(const ShadingPointPacket& shading_points, const CompiledLight& light, double world_per_render,
                  double share, LightSamplePacket& sample);

}  // namespace tracer
