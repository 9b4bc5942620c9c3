#include "tracer/src/integrators/whitted/light_samples.h"

#include <limits>

#include "tracer/src/lights/attenuation.h"
#include "tracer/src/materials/phong.h"
#include "tracer/src/math/power.h"

namespace tracer {
namespace {

WHITTLE_INLINE void directions_to_points(const ShadingPointPacket& f, double share, LightSamplePacket& a) {
  for (int i = 0; i < lanes; ++i) {
    const double x = a.from_x[i] - f.x[i], y = a.from_y[i] - f.y[i], z = a.from_z[i] - f.z[i];
    const double distance = std::sqrt(x * x + y * y + z * z);
    a.distance[i] = distance;
    // A light on the surface has no direction: NaN, which lights nothing.
    a.to_x[i] = x / distance;
    a.to_y[i] = y / distance;
    a.to_z[i] = z / distance;
    a.strength[i] = share;
  }
}

WHITTLE_INLINE void directions_along_axis(const Vec3& axis, double share, LightSamplePacket& a) {
  for (int i = 0; i < lanes; ++i) {
    a.distance[i] = std::numeric_limits<double>::infinity();
    a.to_x[i] = axis.x;
    a.to_y[i] = axis.y;
    a.to_z[i] = axis.z;
    a.strength[i] = share;
  }
}

WHITTLE_INLINE void attenuate_by_polynomial(const std::array<double, 3>& c, double world_per_render,
                                            LightSamplePacket& a) {
  for (int i = 0; i < lanes; ++i) a.strength[i] *= polynomial_attenuation(c, a.distance[i] * world_per_render);
}

WHITTLE_INLINE void attenuate_by_square(double world_per_render, LightSamplePacket& a) {
  for (int i = 0; i < lanes; ++i) a.strength[i] *= inverse_square_attenuation(a.distance[i] * world_per_render);
}

WHITTLE_INLINE void apply_spot_cone(const CompiledLight& light, LightSamplePacket& a) {
  const Vec3 axis = light.axis;
  const double inner = light.cos_inner, outer = light.cos_outer;
  for (int i = 0; i < lanes; ++i)
    a.strength[i] *= spot_factor(-(a.to_x[i] * axis.x + a.to_y[i] * axis.y + a.to_z[i] * axis.z), inner, outer);
}

/// Returns the lanes whose normals point to the side of the light.
WHITTLE_INLINE LaneMask eval_cosine(const ShadingPointPacket& f, LightSamplePacket& a) {
  for (int i = 0; i < lanes; ++i)
    a.cosine[i] = f.normal_x[i] * a.to_x[i] + f.normal_y[i] * a.to_y[i] + f.normal_z[i] * a.to_z[i];
  LaneMask front = 0;
  for (int i = 0; i < lanes; ++i) front |= a.cosine[i] > 0 ? LaneMask{1} << i : 0;
  return front & first_lanes(f.count);
}

WHITTLE_INLINE void eval_reflection_vector(const ShadingPointPacket& f, LightSamplePacket& a) {
  for (int i = 0; i < lanes; ++i)
    a.highlight[i] = phong_cosine({f.normal_x[i], f.normal_y[i], f.normal_z[i]}, {a.to_x[i], a.to_y[i], a.to_z[i]},
                                  {f.eye_x[i], f.eye_y[i], f.eye_z[i]});
}

WHITTLE_INLINE void eval_half_vector(const ShadingPointPacket& f, LightSamplePacket& a) {
  for (int i = 0; i < lanes; ++i) {
    const double cosine = blinn_cosine({f.normal_x[i], f.normal_y[i], f.normal_z[i]}, {a.to_x[i], a.to_y[i], a.to_z[i]},
                                       {f.eye_x[i], f.eye_y[i], f.eye_z[i]});
    a.highlight[i] = f.blinn[i] != 0 ? cosine : a.highlight[i];
  }
}

WHITTLE_INLINE void eval_highlight(const ShadingPointPacket& f, LightSamplePacket& a) {
  for (int i = 0; i < lanes; ++i) a.highlight[i] = power_of(a.highlight[i], f.shininess[i]);
  for (int i = 0; i < lanes; ++i) a.highlight[i] = (f.has_specular[i] != 0) & (a.cosine[i] > 0) ? a.highlight[i] : 0;
}

WHITTLE_INLINE void eval_diffuse(const ShadingPointPacket& f, const Color& radiance, LightSamplePacket& a) {
  for (int i = 0; i < lanes; ++i) {
    const double cosine = a.cosine[i], strength = a.strength[i];
    a.r[i] = f.diffuse_r[i] * cosine * radiance.r * strength;
    a.g[i] = f.diffuse_g[i] * cosine * radiance.g * strength;
    a.b[i] = f.diffuse_b[i] * cosine * radiance.b * strength;
  }
}

WHITTLE_INLINE void eval_diffuse_and_specular(const ShadingPointPacket& f, const Color& radiance,
                                              LightSamplePacket& a) {
  for (int i = 0; i < lanes; ++i) {
    const double cosine = a.cosine[i], strength = a.strength[i], spec = a.highlight[i];
    a.r[i] = (f.diffuse_r[i] * cosine + f.specular_r[i] * spec) * radiance.r * strength;
    a.g[i] = (f.diffuse_g[i] * cosine + f.specular_g[i] * spec) * radiance.g * strength;
    a.b[i] = (f.diffuse_b[i] * cosine + f.specular_b[i] * spec) * radiance.b * strength;
  }
}

/// offset_origin() with a given clearance.
WHITTLE_INLINE void offset_shadow_origins(const ShadingPointPacket& f, LightSamplePacket& a) {
  for (int i = 0; i < lanes; ++i) {
    const Vec3 face{f.face_x[i], f.face_y[i], f.face_z[i]};
    const Vec3 origin = clear_of({f.x[i], f.y[i], f.z[i]}, face, f.clearance[i], {a.to_x[i], a.to_y[i], a.to_z[i]});
    a.origin_x[i] = origin.x;
    a.origin_y[i] = origin.y;
    a.origin_z[i] = origin.z;
  }
}

WHITTLE_INLINE LaneMask black_lanes(const LightSamplePacket& a) {
  LaneMask black = 0;
  for (int i = 0; i < lanes; ++i) black |= (a.r[i] == 0) & (a.g[i] == 0) & (a.b[i] == 0) ? LaneMask{1} << i : 0;
  return black;
}

}  // namespace

WHITTLE_WIDE void sample_light(const ShadingPointPacket& shading_points, const CompiledLight& light,
                               double world_per_render, double share, LightSamplePacket& sample) {
  if (light.kind == light_kind<DirectionalLight>) {
    directions_along_axis(light.axis, share, sample);
  } else {
    directions_to_points(shading_points, share, sample);
    if (light.attenuation.kind == Attenuation::Kind::polynomial)
      attenuate_by_polynomial(light.attenuation.coefficients, world_per_render, sample);
    if (light.attenuation.kind == Attenuation::Kind::inverse_square) attenuate_by_square(world_per_render, sample);
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
