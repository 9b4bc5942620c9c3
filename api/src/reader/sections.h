#pragma once
/// The sections of a scene document: one function for each, and the readers of the values that they share. Readers of
/// values return as those in field_values.h. The order of sections matters for the resolution of names: textures,
/// materials, prototypes, objects.

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "api/src/reader/cursor.h"
#include "tracer/result.h"

namespace api {

/// The scene document at `root`, which may be part of a larger one. Pointers begin at `root`; issues are in its order.
tracer::Result<Document, std::vector<tracer::Issue>> read_scene(json::Tape& tape, json::Node* root,
                                                                const Limits& limits);

void read_image(Reading& reading, const Cursor& at);
void read_camera(Reading& reading, const Cursor& at);
void read_background(Reading& reading, const Cursor& at);
void read_depth_cue(Reading& reading, const Cursor& at);
void read_output(Reading& reading, const Cursor& at);
/// Without the section: the standard accuracy.
void read_accuracy(Reading& reading, const std::optional<Cursor>& at);
void read_lights(Reading& reading, const Cursor& at);
void read_textures(Reading& reading, const Cursor& at);
void read_materials(Reading& reading, const Cursor& at);
void read_prototypes(Reading& reading, const Cursor& at);
void read_objects(Reading& reading, const Cursor& at);
void read_job(Reading& reading, const Cursor& at);

/// The labels of a job by name. Null, if it is allowed, is an empty optional.
void read_labels(Reading& reading, const Cursor& at, bool null_allowed,
                 std::map<std::string, std::optional<std::string>>& labels);

/// The fields of a mesh object.
class Fields;
void read_mesh(Reading& reading, Fields& fields, tracer::Shape& shape);

/// A file's name as one of the scene's assets, of which there is one for each name.
bool read(Reading& reading, const Cursor& at, tracer::AssetId& asset);
/// A 4 x 4 matrix, or a list of steps applied in the order written.
bool read(Reading& reading, const Cursor& at, tracer::Transform& transform);
/// A name, of a prototype; or of a texture or a material, which may also be written in place.
bool read(Reading& reading, const Cursor& at, tracer::PrototypeId& prototype);
bool read(Reading& reading, const Cursor& at, tracer::TextureId& texture);
bool read(Reading& reading, const Cursor& at, tracer::MaterialId& material);
bool read(Reading& reading, const Cursor& at, tracer::ColorOrTexture& value);

}  // namespace api
