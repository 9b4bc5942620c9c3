#pragma once
/// What a scene needs, and so what will be modelled: rays of a kind that nothing asks for are never made.

#include <string>
#include <string_view>
#include <vector>

#include "tracer/scene.h"

namespace tracer {

struct Requirements {
  bool reflection = false;  ///< a material mirrors, or refracts (total internal reflection mirrors too)
  bool refraction = false;  ///< a material transmits
  bool fresnel = false;
  bool shadows = false;               ///< a light casts them and there is something to shade
  bool transmissive_shadows = false;  ///< an occluder lets light through
  bool soft_lights = false;           ///< a light has a length, an area or a surface
  bool many_lights = false;           ///< so many that those which cannot matter are worth telling apart
  bool absorption = false;            ///< a solid takes light on the way through
  bool overlapping_media = false;     ///< transmissive solids may overlap: their priorities, or more than one, matter
  bool gouraud = false;               ///< the local model is evaluated at the corners of triangles
  bool lens = false;                  ///< camera rays start on a lens
  bool depth_cue = false;
  bool layers = false;             ///< something is kept of what camera rays hit: layers or alpha
  bool environment = false;        ///< the background is looked up in textures
  bool textures = false;           ///< of surfaces
  bool bump = false;               ///< textures bend normals: bump or normal maps
  bool filtered_textures = false;  ///< one of them is filtered: rays carry the width of what they cover
  bool smooth_normals = false;
  bool triangles = false;
  bool spheres = false;
  bool quadrics = false;  ///< discs, cylinders, cones, boxes
  bool planes = false;
  bool approximations = false;  ///< something is modelled more cheaply than it is
};

/// A requirement by the name it has in replies, reports and on the command line.
struct RequirementName {
  std::string_view name;
  bool Requirements::*needed;
};

/// All of them, in the order they are told.
inline constexpr RequirementName requirement_names[] = {
    {"reflection", &Requirements::reflection},
    {"refraction", &Requirements::refraction},
    {"fresnel", &Requirements::fresnel},
    {"shadows", &Requirements::shadows},
    {"transmissive_shadows", &Requirements::transmissive_shadows},
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
    {"approximations", &Requirements::approximations},
};

/// Why a scene needs something.
struct RequirementReason {
  bool Requirements::*needed;
  std::string pointer;  ///< the first part of the document that needs it, e.g. "/materials/glass"
};

/// Never fails. Only what the objects use counts: a glass material that no object has requires nothing; nor does what
/// the scene's approximations do without. `reasons`, unless null, receives one for each requirement that holds.
Requirements requirements(const Scene& scene, std::vector<RequirementReason>* reasons = nullptr);

/// What the same scene needs without its approximations.
Requirements exact_requirements(const Scene& scene);

}  // namespace tracer
