#pragma once
/// The light of one light at a packet of places, if nothing is in the way.

#include "tracer/src/interaction/shading_points.h"
#include "tracer/src/lights/registry.h"
#include "tracer/src/math/compress.h"

namespace tracer {

/// Beside a ShadingPointPacket.
struct alignas(64) LightSamplePacket {
  double from_x[lanes], from_y[lanes], from_z[lanes];  ///< given: the light's points; a directional one's mean nothing

  double to_x[lanes], to_y[lanes], to_z[lanes];              ///< unit, towards the light
  double distance[lanes];                                    ///< trace frame; infinite for directional lights
  double cosine[lanes];                                      ///< N.L
  double strength[lanes];                                    ///< `share` after attenuation and the spot's cone
  double highlight[lanes];                                   ///< its cosine, then spec
  double origin_x[lanes], origin_y[lanes], origin_z[lanes];  ///< where the shadow ray starts
  double r[lanes], g[lanes], b[lanes];                       ///< what the sample gains

  LaneMask gaining;  ///< those that gain anything. Where none does, what stands above from `highlight` on means nothing

  [[nodiscard]] Vec3 to_light(int i) const { return {to_x[i], to_y[i], to_z[i]}; }
  [[nodiscard]] Vec3 origin(int i) const { return {origin_x[i], origin_y[i], origin_z[i]}; }
  [[nodiscard]] Color color(int i) const { return {r[i], g[i], b[i]}; }
};

/// Works out `arrival` for a `share` of `light`. Distances of the trace frame times `world_per_trace` are the world's.
void sample_light(const ShadingPointPacket& shading_points, const CompiledLight& light, double world_per_trace,
                  double share, LightSamplePacket& arrival);

}  // namespace tracer
