#pragma once
/// Shapes of a scene document. Each lists its fields; tracer/src/shapes implements its geometry.

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "tracer/document_fields.h"
#include "tracer/values.h"

namespace tracer {

struct Sphere {
  Vec3 center{};
  double radius = 1;
  Vec3 axis{0, 1, 0};      ///< pole, v = 1
  Vec3 meridian{1, 0, 0};  ///< phi = 0; projected across the axis

  static constexpr std::string_view type = "sphere", noun = "a sphere";
  static constexpr auto fields() {
    return std::tuple{Field{"center", &Sphere::center, FieldRange::position},
                      Field{"radius", &Sphere::radius, FieldRange::length},
                      optional_field("axis", &Sphere::axis, FieldRange::direction),
                      Field{"meridian", &Sphere::meridian, FieldRange::direction, FieldPresence::derived}};
  }
};

/// Infinite plane. u, v run along e0 and e1 = n x e0 from `point`, in scene units; e0 is `u_axis` projected across n.
/// Unset: the world x axis, or z where n is along x.
struct Plane {
  Vec3 point{};
  Vec3 normal{0, 1, 0};
  std::optional<Vec3> u_axis;

  static constexpr std::string_view type = "plane", noun = "a plane";
  static constexpr auto fields() {
    return std::tuple{Field{"point", &Plane::point, FieldRange::position},
                      Field{"normal", &Plane::normal, FieldRange::direction},
                      Field{"u_axis", &Plane::u_axis, FieldRange::direction}};
  }
};

/// Flat and round, with a hole of `inner_radius`. u, v = d.e0/2R + 1/2, d.e1/2R + 1/2; e0 as the plane's.
struct Disc {
  Vec3 center{};
  Vec3 normal{0, 1, 0};
  double radius = 1;
  double inner_radius = 0;
  std::optional<Vec3> u_axis;

  static constexpr std::string_view type = "disc", noun = "a disc";
  static constexpr auto fields() {
    return std::tuple{Field{"center", &Disc::center, FieldRange::position},
                      Field{"normal", &Disc::normal, FieldRange::direction},
                      Field{"radius", &Disc::radius, FieldRange::length},
                      optional_field("inner_radius", &Disc::inner_radius, FieldRange::length_or_0),
                      Field{"u_axis", &Disc::u_axis, FieldRange::direction}};
  }
};

/// u = phi/2pi about the axis from e0, v = z/length from `from` to `to`; caps as discs about the same e0 and e1.
struct Cylinder {
  Vec3 from{}, to{0, 1, 0};
  double radius = 1;
  bool caps = true;
  std::optional<Vec3> u_axis;

  static constexpr std::string_view type = "cylinder", noun = "a cylinder";
  static constexpr auto fields() {
    return std::tuple{Field{"from", &Cylinder::from, FieldRange::position},
                      Field{"to", &Cylinder::to, FieldRange::position},
                      Field{"radius", &Cylinder::radius, FieldRange::length}, optional_field("caps", &Cylinder::caps),
                      Field{"u_axis", &Cylinder::u_axis, FieldRange::direction}};
  }
};

/// A cone, or a truncated one where `apex_radius` > 0. u as the cylinder's about the axis from base to apex, v = 0 at
/// the base and 1 at the apex.
struct Cone {
  Vec3 apex{0, 1, 0}, base{};
  double radius = 1;  ///< at the base
  double apex_radius = 0;
  bool caps = true;
  std::optional<Vec3> u_axis;

  static constexpr std::string_view type = "cone", noun = "a cone";
  static constexpr auto fields() {
    return std::tuple{Field{"apex", &Cone::apex, FieldRange::position},
                      Field{"base", &Cone::base, FieldRange::position},
                      Field{"radius", &Cone::radius, FieldRange::length},
                      optional_field("apex_radius", &Cone::apex_radius, FieldRange::length_or_0),
                      optional_field("caps", &Cone::caps),
                      Field{"u_axis", &Cone::u_axis, FieldRange::direction}};
  }
};

/// Axis-parallel. u, v in [0,1] on each face: seen from outside, u to the right and v up, up being y (on the top face
/// -z, on the bottom face z).
struct Box {
  Vec3 min{}, max{1, 1, 1};

  static constexpr std::string_view type = "box", noun = "a box";
  static constexpr auto fields() {
    return std::tuple{Field{"min", &Box::min, FieldRange::position}, Field{"max", &Box::max, FieldRange::position}};
  }
};

/// Ring: the points at `minor_radius` from a circle of `major_radius` around `center`, in the plane across `axis`.
/// u = phi/2pi about the axis from e0 as the plane's, v = theta/2pi around the tube, from its outermost circle towards
/// the axis' end.
struct Torus {
  Vec3 center{};
  Vec3 axis{0, 1, 0};
  double major_radius = 1;
  double minor_radius = 0.25;  ///< < major_radius
  std::optional<Vec3> u_axis;

  static constexpr std::string_view type = "torus", noun = "a torus";
  static constexpr auto fields() {
    return std::tuple{Field{"center", &Torus::center, FieldRange::position},
                      Field{"axis", &Torus::axis, FieldRange::direction},
                      Field{"major_radius", &Torus::major_radius, FieldRange::length},
                      Field{"minor_radius", &Torus::minor_radius, FieldRange::length},
                      Field{"u_axis", &Torus::u_axis, FieldRange::direction}};
  }
};

/// Front side: counter-clockwise. Texture coordinates are barycentric of `uvs` (0,0 / 1,0 / 0,1 when unset).
struct Triangle {
  std::array<Vec3, 3> vertices{};
  std::optional<std::array<Vec3, 3>> normals;
  std::optional<std::array<Vec2, 3>> uvs;

  static constexpr std::string_view type = "triangle", noun = "a triangle";
  static constexpr auto fields() {
    return std::tuple{Field{"vertices", &Triangle::vertices, FieldRange::position},
                      Field{"normals", &Triangle::normals, FieldRange::direction},
                      Field{"uvs", &Triangle::uvs, FieldRange::texture_point}};
  }
};

/// Triangles of a mesh file for which the file names a material: from `first` to the `first` of the next part.
struct MeshPart {
  std::string name;
  std::size_t first = 0;
};

/// Indexed triangles, counter-clockwise seen from the front. `normals` and `uvs` are per position or empty.
/// A mesh with a `file` has no other content but `smooth` and `part_materials` until the file is read into it, before
/// `compile`, which ignores parts: a mesh with several materials must be split before.
struct Mesh {
  std::vector<Vec3> positions;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  std::vector<Vec3> normals;
  std::vector<Vec2> uvs;
  bool smooth = false;  ///< area-weighted vertex normals where `normals` is empty
  std::optional<AssetId> file{};
  std::vector<MeshPart> parts{};                       ///< in order; triangles before the first one have no name
  std::map<std::string, MaterialId> part_materials{};  ///< by the name of the part; others have that of the object
  /// 1 for a triangle of the polygon that the triangle before it belongs to; 0 for those that are left out at the end.
  std::vector<std::uint8_t> continues_polygon{};
  std::optional<float> time{};  ///< glTF: seconds of the first animation; unset: the pose of the nodes

  static constexpr std::string_view type = "mesh", noun = "a mesh";
};

/// One placement of the objects of a prototype.
struct Instance {
  PrototypeId of{};
  std::optional<MaterialId> material;  ///< replaces the materials of all of them; unset: each keeps its own

  static constexpr std::string_view type = "instance", noun = "an instance";
};

using Shape = std::variant<Sphere, Plane, Disc, Cylinder, Cone, Box, Torus, Triangle, Mesh, Instance>;

}  // namespace tracer
