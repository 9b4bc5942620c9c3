#pragma once
/// The sections of a scene document, one function each. Order matters where names are resolved: textures, materials,
/// prototypes, objects.

#include <optional>

#include "api/src/reader/cursor.h"

namespace api {

/// All of it: the table of contents. False when what the document means is unknown (no object, another version): then
/// nothing can be said about its meaning.
bool read_document(Reading& reading, const Cursor& at);

void read_image(Reading& reading, const Cursor& at);
void read_camera(Reading& reading, const Cursor& at);
void read_background(Reading& reading, const Cursor& at);
void read_depth_cue(Reading& reading, const Cursor& at);
void read_output(Reading& reading, const Cursor& at);
/// Nothing there asks for something too: the standard accuracy.
void read_accuracy(Reading& reading, const std::optional<Cursor>& at);
void read_lights(Reading& reading, const Cursor& at);
void read_textures(Reading& reading, const Cursor& at);
void read_materials(Reading& reading, const Cursor& at);
void read_prototypes(Reading& reading, const Cursor& at);
void read_objects(Reading& reading, const Cursor& at);
void read_job(Reading& reading, const Cursor& at);

void read_webhook(Reading& reading, const Cursor& at, std::optional<Webhook>& webhook);

/// A mesh object's own fields.
class Fields;
void read_mesh(Reading& reading, Fields& fields, tracer::Shape& shape);

/// A file's name as one of the scene's assets, where files that are named twice are one. False where it is none that
/// may be named, which has been told then.
bool read_asset(Reading& reading, const Cursor& at, tracer::AssetId& asset);

/// A 4 x 4 matrix, or a list of steps applied in the order written. Unset where it is neither, which has been told
/// then.
void read_transform(Reading& reading, const Cursor& at, std::optional<tracer::Transform>& transform);

/// A prototype's name; no prototype where there is none, which has been told then.
tracer::PrototypeId read_prototype_reference(Reading& reading, const Cursor& at);

/// A texture written in place or named; no texture where it is neither, which has been told then.
tracer::TextureId read_texture_reference(Reading& reading, const Cursor& at);
void read_color_or_texture(Reading& reading, const Cursor& at, tracer::ColorOrTexture& value);

/// A material written in place or named; no material where it is neither, which has been told then.
tracer::MaterialId read_material_reference(Reading& reading, const Cursor& at);

}  // namespace api
