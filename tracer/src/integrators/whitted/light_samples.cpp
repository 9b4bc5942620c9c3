#include "tracer/src/integrators/whitted/light_samples.h"

#include <limits>

#include "tracer/src/lights/compiled_light.h"
#include "tracer/src/materials/phong.h"
#include "tracer/src/math/power.h"

namespace tracer {
namespace {

WHITTLE_INLINE void directions_to_points(const ShadingPointPacket& f, double share, LightSamplePacket& a) {
  for (int i = 0; i < lanes; ++i) {
    const Vec3 offset = a.from[i] - f.position[i];
    const double distance = length(offset);
    a.distance[i] = distance;
    a.to_light.set(i, offset / distance);  // a light on the surface has no direction: NaN, which lights nothing
    a.strength[i] = share;
  }
}

WHITTLE_INLINE void directions_along_axis(const Vec3& axis, double share, LightSamplePacket& a) {
  for (int i = 0; i < lanes; ++i) {
    a.distance[i] = std::numeric_limits<double>::infinity();
    a.to_light.set(i, axis);
    a.strength[i] = share;
  }
}

WHITTLE_INLINE void attenuate(const Attenuation& attenuation, double world_per_render, LightSamplePacket& a) {
  const std::array<double, 3> c = attenuation.coefficients;
  if (attenuation.kind == Attenuation::Kind::polynomial)
    for (int i = 0; i < lanes; ++i) a.strength[i] *= polynomial_attenuation(c, a.distance[i] * world_per_render);
  if (attenuation.kind == Attenuation::Kind::inverse_square)
    for (int i = 0; i < lanes; ++i) a.strength[i] *= inverse_square_attenuation(a.distance[i] * world_per_render);
}

WHITTLE_INLINE void apply_spot_cone(const CompiledLight& light, LightSamplePacket& a) {
  const Vec3 axis = light.axis;
  const double inner = light.cos_inner, outer = light.cos_outer;
  for (int i = 0; i < lanes; ++i) a.strength[i] *= spot_factor(-dot(a.to_light[i], axis), inner, outer);
}

/// Returns the lanes whose normals point to the side of the light.
WHITTLE_INLINE LaneMask eval_cosine(const ShadingPointPacket& f, LightSamplePacket& a) {
  for (int i = 0; i < lanes; ++i) a.cosine[i] = dot(f.normal[i], a.to_light[i]);
  LaneMask front = 0;
  for (int i = 0; i < lanes; ++i) front |= lane_bit(i, a.cosine[i] > 0);
  return front & first_lanes(f.count);
}

WHITTLE_INLINE void eval_reflection_vector(const ShadingPointPacket& f, LightSamplePacket& a) {
  for (int i = 0; i < lanes; ++i) a.highlight[i] = phong_cosine(f.normal[i], a.to_light[i], f.to_eye[i]);
}

WHITTLE_INLINE void eval_half_vector(const ShadingPointPacket& f, LightSamplePacket& a) {
  for (int i = 0; i < lanes; ++i) {
    const double cosine = blinn_cosine(f.normal[i], a.to_light[i], f.to_eye[i]);
    a.highlight[i] = f.blinn[i] != 0 ? cosine : a.highlight[i];
  }
}

WHITTLE_INLINE void eval_highlight(const ShadingPointPacket& f, LightSamplePacket& a) {
  for (int i = 0; i < lanes; ++i) a.highlight[i] = power_of(a.highlight[i], f.shininess[i]);
  for (int i = 0; i < lanes; ++i) a.highlight[i] = (f.has_specular[i] != 0) & (a.cosine[i] > 0) ? a.highlight[i] : 0;
}

WHITTLE_INLINE void eval_diffuse(const ShadingPointPacket& f, const Color& radiance, LightSamplePacket& a) {
  for (int i = 0; i < lanes; ++i) a.radiance.set(i, f.diffuse[i] * a.cosine[i] * radiance * a.strength[i]);
}

WHITTLE_INLINE void eval_diffuse_and_specular(const ShadingPointPacket& f, const Color& radiance,
                                              LightSamplePacket& a) {
  for (int i = 0; i < lanes; ++i)
    a.radiance.set(i, (f.diffuse[i] * a.cosine[i] + f.specular[i] * a.highlight[i]) * radiance * a.strength[i]);
}

/// offset_origin() with a given clearance.
WHITTLE_INLINE void offset_shadow_origins(const ShadingPointPacket& f, LightSamplePacket& a) {
  for (int i = 0; i < lanes; ++i) a.origin.set(i, clear_of(f.position[i], f.face[i], f.clearance[i], a.to_light[i]));
}

WHITTLE_INLINE LaneMask black_lanes(const LightSamplePacket& a) {
  LaneMask black = 0;
  for (int i = 0; i < lanes; ++i) black |= lane_bit(i, is_black(a.radiance[i]));
  return black;
}

}  // namespace

WHITTLE_WIDE void sample_light(const ShadingPointPacket& shading_points, const CompiledLight& light,
                               double world_per_render, double share, LightSamplePacket& sample) {
  if (light.kind == light_kind<DirectionalLight>) {
    directions_along_axis(light.axis, share, sample);
  } else {
    directions_to_points(shading_points, share, sample);
    attenuate(light.attenuation, world_per_render, sample);
    if (light.kind == light_kind<SpotLight>) apply_spot_cone(light, sample);
  }
  sample.lit = eval_cosine(shading_points, sample);
  if (sample.lit == 0) return;  // common: neighbors share their orientation
  if (shading_points.any_specular) {
    eval_reflection_vector(shading_points, sample);
    if (shading_points.any_blinn) eval_half_vector(shading_points, sample);
    eval_highlight(shading_points, sample);
    eval_diffuse_and_specular(shading_points, light.radiance, sample);
  } else {
    eval_diffuse(shading_points, light.radiance, sample);
  }
  sample.lit &= ~black_lanes(sample);
  if (light.shadows) offset_shadow_origins(shading_points, sample);
}

}  // namespace tracer
