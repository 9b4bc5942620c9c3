#pragma once
/// Features that a scene needs. They select the instantiation of the integrator: unused features cost nothing.

#include <string>
#include <string_view>
#include <vector>

#include "tracer/scene.h"

namespace tracer {

struct Requirements {
  bool reflection = false;  ///< a material reflects, or refracts (total internal reflection)
  bool refraction = false;  ///< a material transmits or is cut out
  bool fresnel = false;
  bool shadows = false;               ///< a light casts shadows and there is a surface
  bool transmissive_shadows = false;  ///< an occluder transmits light, or the outside absorbs it
  bool transmitted_light = false;     ///< a surface is lit from behind
  bool soft_lights = false;           ///< a light has a length, an area or a surface
  bool many_lights = false;           ///< so many lights that negligible ones are culled
  bool absorption = false;            ///< a solid or the outside absorbs light
  bool overlapping_media = false;     ///< transmissive solids may overlap
  bool gouraud = false;               ///< shading is evaluated at the vertices or centroids of triangles
  bool lens = false;                  ///< camera rays start on a lens
  bool depth_cue = false;
  bool layers = false;             ///< the output has layers or alpha
  bool environment = false;        ///< the background has textures
  bool textures = false;           ///< a surface has a texture
  bool bump = false;               ///< a surface has a bump map or a normal map
  bool filtered_textures = false;  ///< a texture is filtered: rays carry their footprint
  bool smooth_normals = false;
  bool triangles = false;
  bool spheres = false;
  bool quadrics = false;  ///< discs, cylinders, cones, boxes
  bool planes = false;
  bool global_light = false;     ///< surfaces reflect the light of other surfaces diffusely
  bool principled = false;       ///< a material is principled: rays are spread over the directions of facets
  bool emitters = false;         ///< and a finite surface glows, or the background has textures
  bool interreflection = false;  ///< and the light between surfaces is approximated
  bool approximations = false;   ///< an approximation changes the image
};

/// True if light arrives by way of other surfaces.
inline bool has_secondary_rays(const Requirements& needs) {
  return needs.reflection || needs.refraction || needs.global_light;
}

/// True if samples at one place of the image differ by chance, beyond the lens.
inline bool has_random_rays(const Requirements& needs) {
  return needs.soft_lights || needs.global_light || needs.principled;
}

/// A requirement and its name in responses, reports and on the command line.
struct RequirementName {
  std::string_view name;
  bool Requirements::*needed;
};

/// All requirements, in output order.
inline constexpr RequirementName requirement_names[] = {
    {"reflection", &Requirements::reflection},
    {"refraction", &Requirements::refraction},
    {"fresnel", &Requirements::fresnel},
    {"shadows", &Requirements::shadows},
    {"transmissive_shadows", &Requirements::transmissive_shadows},
    {"transmitted_light", &Requirements::transmitted_light},
    {"soft_lights", &Requirements::soft_lights},
    {"many_lights", &Requirements::many_lights},
    {"absorption", &Requirements::absorption},
    {"overlapping_media", &Requirements::overlapping_media},
    {"gouraud", &Requirements::gouraud},
    {"lens", &Requirements::lens},
    {"depth_cue", &Requirements::depth_cue},
    {"layers", &Requirements::layers},
    {"environment", &Requirements::environment},
    {"textures", &Requirements::textures},
    {"filtered_textures", &Requirements::filtered_textures},
    {"bump", &Requirements::bump},
    {"smooth_normals", &Requirements::smooth_normals},
    {"triangles", &Requirements::triangles},
    {"spheres", &Requirements::spheres},
    {"quadrics", &Requirements::quadrics},
    {"planes", &Requirements::planes},
    {"global_light", &Requirements::global_light},
    {"emitters", &Requirements::emitters},
    {"principled", &Requirements::principled},
    {"interreflection", &Requirements::interreflection},
    {"approximations", &Requirements::approximations},
};

/// Reason for a requirement.
struct RequirementReason {
  bool Requirements::*needed;
  std::string pointer;  ///< JSON pointer of the first part of the document that needs it, e.g. "/materials/glass"
};

/// Never fails. Unused materials and features disabled by the scene's approximations require nothing. `reasons`, unless
/// null, receives one entry for each requirement that holds.
Requirements requirements(const Scene& scene, std::vector<RequirementReason>* reasons = nullptr);

/// One sentence, without a subject: the light that Accuracy::Model::global adds to the scene, from its materials and
/// background alone: "adds light between surfaces of 3 diffuse colors that reflect up to 0.89 in a closed room, at most
/// 8 times the brightest light without it; glowing surfaces light others (/materials/lamp)". Image files count as
/// white, except that the sentence states a material that only a white image file makes impossible as such.
/// Precondition: validate() accepts the scene.
std::string global_light_summary(const Scene& scene);

/// Requirements of the scene without its approximations.
Requirements exact_requirements(const Scene& scene);

}  // namespace tracer
