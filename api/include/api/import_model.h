#pragma once
/// Model files as scene documents: a document whose "model" names an OBJ, PLY, STL, glTF or GLB file stands for one
/// with the file's mesh, materials, camera and lights.

#include <string>
#include <vector>

#include "api/document.h"
#include "api/load_assets.h"
#include "tracer/limits.h"
#include "tracer/result.h"

namespace api {

struct ImportedModel {
  std::string text;                  ///< the document, on several lines
  std::vector<std::string> omitted;  ///< sentences about parts of the file that the document does not have
};

/// The document that one with a `model` stands for, which parse_scene() accepts. Its own members come first: its
/// camera, image, background, lights and accuracy replace those of the model, and its materials and objects are added.
/// Without a camera in the file, one shows the whole model from three quarters above; without lights, a sky and a key
/// light shine. Calls `read` for the model and for files that it names. All issues: "bad_asset" at "/model", a sentence
/// that begins with the file's name, else those of the document. Throws only exceptions of `read`. Precondition: the
/// document has a model.
tracer::Result<ImportedModel, std::vector<tracer::Issue>> import_model(const Document& document, const ReadAsset& read,
                                                                       const Limits& limits);

}  // namespace api
