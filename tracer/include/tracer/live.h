#pragma once
/// The live form of a scene: all that a ray tracer in a fragment shader (WebGL2) reads, as tables of 32-bit numbers.
///
///   auto omitted = tracer::leave_out(scene);                      // before compile(), which then prepares less
///   auto compiled = tracer::compile(scene, control, assets);
///   auto live = tracer::live_scene(scene, **compiled);            // or a sentence: a limit is exceeded
///
/// Tables of floats consist of cells of four. Numbers that are kinds, flags or indices are below 2^24, where every
/// integer is a float. Geometry and lights are in render space: a point p of the world is (p - origin) * scale there.
/// All units of materials and attenuation are those of the document. The cells of each table:
///
/// `nodes`       Two cells a node, depth first: (low, next), (high, count). A leaf has the primitives [next, next +
///               count); with a count of 0 it is an inner node, whose children are the node behind it and node `next`.
/// `primitives`  One cell: (a, b, c, code) is a triangle with these vertices; (-1 - kind, cell, 0, code) is a shape at
///               that cell, of kind 0 a sphere, else as 1 + QuadricKind. code = 2 object + 1 if light may pass, else 2
///               object.
/// `vertices`    Two cells: (position, u), (normal, v). A zero normal stands for that of the face.
/// `shapes`      A sphere is the cell (center, radius). Another one has seven: (origin, radius_0), the columns of
///               shape_from_render with radius_1, caps and curvature, and those of render_from_shape.
/// `planes`      Two cells: (point, code), (normal, 0).
/// `objects`     `object_cells` each: (material, flags, diagonal, 0), and, if there are textures, the axes e0, e1 and n
///               of texture coordinates. flags = 1 if it casts no shadow + 2 if a mesh has no texture coordinates + 4 *
///               MediumBoundary.
/// `materials`   `material_cells` each: the colors of tracer::Material as (color, index of its texture + 1 or 0), its
///               numbers, four a cell, and (flags, normal_map, bump, scale of bump), textures as index + 1 or 0.
///               `material_fields` has the places of colors and numbers. flags = model + 4 transparency + 16 if
///               fresnel + 32 if the normals are those of the faces + 64 if it has textures.
/// `lights`      (position, kind), (color, intensity), (axis, cos_inner), (u, cos_outer), (v, radius), (coefficients,
///               kind of attenuation), (1 if it casts shadows, 0, 0, 0), as tracer/src/lights/light_registry.h.
/// `textures`    (pattern, filter, wrap, octaves), (first color, first texel), (second color, levels), (scale, offset),
///               (width, height, 0, 0), (factor, 0): pattern and the enumerators in the order of tracer/materials.h.
/// `background`  (kind, 0, 0, 0), (color or zenith, 0), (nadir, 0), (up, 0), and for each texture around the scene
///               (axis, texture), (right, wrap along u), (up, wrap along v).
/// `texels`      Two words: 16-bit floats of red and green, and of blue. An image has its mip levels one after the
///               other, each half as wide and high as the one before it, rounded down; row 0 is on top.

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tracer/compile.h"
#include "tracer/requirements.h"
#include "tracer/result.h"
#include "tracer/scene.h"

namespace tracer {

struct LiveLimits {
  std::uint64_t cells = 2048 * 2048;  ///< each table, and texels: the texture that every WebGL2 has
  std::uint64_t bytes = 40u << 20;    ///< all tables: a download of seconds, half a million triangles
};

/// Nodes above a leaf at most: the stack of the traversal.
inline constexpr std::uint32_t live_bvh_depth_max = 48;

/// A part of the document that the live form does not have, or only roughly.
struct LiveOmission {
  std::string pointer;  ///< JSON pointer: "/accuracy/model"
  std::string detail;   ///< the end of a sentence that begins with the part
};

struct LiveScene {
  std::vector<float> nodes, primitives, vertices, shapes, planes, objects, materials, lights, textures, background;
  std::vector<std::uint32_t> texels;
  std::uint32_t object_cells = 1, material_cells = 0;
  std::vector<std::pair<std::string_view, std::uint32_t>> material_fields;  ///< field and its first number in a row
  Vec3 origin{};
  double scale = 1;
  Requirements needs;
  std::vector<LiveOmission> omitted;  ///< in addition to those of leave_out()
};

/// The tables of floats and their names in messages.
struct LiveTable {
  const char* name;
  std::vector<float> LiveScene::*table;
};
inline constexpr LiveTable live_tables[] = {
    {"nodes", &LiveScene::nodes},          {"primitives", &LiveScene::primitives}, {"vertices", &LiveScene::vertices},
    {"shapes", &LiveScene::shapes},        {"planes", &LiveScene::planes},         {"objects", &LiveScene::objects},
    {"materials", &LiveScene::materials},  {"lights", &LiveScene::lights},         {"textures", &LiveScene::textures},
    {"background", &LiveScene::background}};

/// Removes from the scene what compile() would prepare in vain: light between surfaces and approximations. Returns all
/// parts that are left out because of the document alone.
std::vector<LiveOmission> leave_out(Scene& scene);

/// Precondition: `compiled` was compiled from `scene` after leave_out(); meshes may have been moved out of it. The
/// error is a sentence that names a limit and the value found, or a coordinate or size that no 32-bit float can hold.
/// Throws std::bad_alloc.
Result<LiveScene, std::string> live_scene(const Scene& scene, const CompiledScene& compiled,
                                          const LiveLimits& limits = {});

}  // namespace tracer
