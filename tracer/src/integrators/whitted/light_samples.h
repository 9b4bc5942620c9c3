#pragma once
/// Unoccluded direct lighting of one light at 16 shading points.

#include "tracer/src/interaction/shading_points.h"
#include "tracer/src/lights/light_registry.h"

namespace tracer {

/// Lane by lane with a ShadingPointPacket. From `highlight` on undefined if no lane is lit.
struct alignas(64) LightSamplePacket {
  VecLanes from;  ///< input: points of the light, unless it is directional

  VecLanes to_light;        ///< unit
  double distance[lanes];   ///< render space; infinite for directional lights
  double cosine[lanes];     ///< N.L
  double strength[lanes];   ///< `share` after attenuation and the spot's cone
  double highlight[lanes];  ///< specular cosine, then its power
  VecLanes origin;          ///< origin of the shadow ray
  ColorLanes radiance;      ///< added to the sample if not occluded

  LaneMask lit;  ///< lanes that receive light
};

/// Evaluates the fraction `share` of `light`. `world_per_render` converts render-space distances to world space.
void sample_light(const ShadingPointPacket& shading_points, const CompiledLight& light, double world_per_render,
                  double share, LightSamplePacket& sample);

}  // namespace tracer
