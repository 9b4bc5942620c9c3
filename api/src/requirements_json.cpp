#include "api/src/requirements_json.h"

#include <nlohmann/json.hpp>

namespace api {

nlohmann::ordered_json requirements_json(const tracer::Requirements& needs) {
  return {{"reflection", needs.reflection},
          {"refraction", needs.refraction},
          {"fresnel", needs.fresnel},
          {"shadows", needs.shadows},
          {"transmissive_shadows", needs.transmissive_shadows},
          {"textures", needs.textures},
          {"smooth_normals", needs.smooth_normals},
          {"triangles", needs.triangles},
          {"spheres", needs.spheres},
          {"planes", needs.planes}};
}

}  // namespace api
