#pragma once
/// Parts of a model that importers of file formats find.

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "api/json.h"
#include "api/load_assets.h"
#include "tracer/limits.h"
#include "tracer/result.h"
#include "tracer/scene.h"

namespace api {

/// A model in the members of a scene document.
struct Model {
  tracer::Mesh mesh;  ///< all triangles, for their bounds
  Json object;        ///< the mesh of the document
  Json materials = Json::object();
  Json lights = Json::array();
  std::optional<Json> camera;
  double aspect = 0;       ///< width over height of the camera's image; 0: any
  double illuminance = 0;  ///< light that a surface at the center receives, in the units of `lights`
  bool up_is_z = false;
  std::vector<std::string> omitted;
};

/// Reads the files of a model. `name` is its name in the document; files that it names are beside it.
struct ModelSource {
  std::string name;
  std::vector<std::uint8_t> bytes;
  std::optional<double> time;
  ReadAsset read;
  const tracer::Limits& limits;

  /// Path in the document of a file beside the model. A path with a drive, a root or ".." is kept as it is.
  [[nodiscard]] std::string beside(std::string_view path) const {
    const std::size_t slash = name.rfind('/');
    return (slash == std::string::npos ? "" : name.substr(0, slash + 1)) + std::string(path);
  }
};

/// A number with nine digits: documents are read by people.
double rounded(double value);
Json vector_json(const tracer::Vec3& v);

/// Names in the mesh of the document the materials of its parts, and one for all others.
void name_materials(Model& model);

tracer::Result<Model, std::string> import_gltf(const ModelSource& source);
/// OBJ with the materials of its MTL files, PLY and STL.
tracer::Result<Model, std::string> import_mesh(const ModelSource& source);

}  // namespace api
