#include "api/src/gltf/primitives.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "tracer/mesh_file.h"

namespace api::gltf {
namespace {

using tracer::Vec3;
using Corners = std::array<std::uint32_t, 3>;

/// Reads an attribute: rows of that many components, as many as there are positions; null if it is missing.
const Accessor* read_attribute(File& file, const Cursor& attributes, std::string_view name, std::size_t components,
                               const Accessor* positions) {
  const auto at = file.member(attributes, name);
  if (!at) return nullptr;
  const Accessor& accessor = file.accessor(*at);
  if (accessor.components != components || accessor.component == Accessor::Component::uint32)
    refuse(*at, "must be an accessor of VEC" + std::to_string(components) + ", not of uint32");
  if (positions != nullptr && accessor.count != positions->count)
    refuse(*at, "has " + std::to_string(accessor.count) + " rows, but there are " + std::to_string(positions->count) +
                    " positions");
  return &accessor;
}

const Accessor* read_indices(File& file, const Cursor& at) {
  using enum Accessor::Component;
  const Accessor& indices = file.accessor(at);
  const bool is_unsigned = indices.component == uint8 || indices.component == uint16 || indices.component == uint32;
  if (indices.components != 1 || !is_unsigned || indices.normalized)
    refuse(at, "must be an accessor of SCALAR, of uint8, uint16 or uint32");
  return &indices;
}

std::string read_material_name(File& file, const Cursor& at) {
  const Cursor& material = file.target(at, "materials");
  const auto name = file.member(material, "name");
  const bool is_named = name && name->node->kind == json::Kind::string && !name->node->string().empty();
  return is_named ? std::string(name->node->string()) : "#" + std::to_string(material.index);
}

void read_primitive(File& file, const Cursor& at, std::vector<Primitive>& primitives) {
  const std::uint64_t mode = file.integer_or(at, "mode", 6, 4);
  if (mode < 4) return;  // points and lines have no surface
  Primitive primitive;
  primitive.mode = static_cast<Primitive::Mode>(mode);
  primitive.at = at;
  const Cursor attributes = file.required_member(at, "attributes");
  file.required_member(attributes, "POSITION");
  primitive.positions = read_attribute(file, attributes, "POSITION", 3, nullptr);
  primitive.normals = read_attribute(file, attributes, "NORMAL", 3, primitive.positions);
  primitive.uvs = read_attribute(file, attributes, "TEXCOORD_0", 2, primitive.positions);
  primitive.joints = read_attribute(file, attributes, "JOINTS_0", 4, primitive.positions);
  primitive.weights = read_attribute(file, attributes, "WEIGHTS_0", 4, primitive.positions);
  for (const Cursor& target : file.list(at, "targets"))
    primitive.targets.push_back({read_attribute(file, target, "POSITION", 3, primitive.positions),
                                 read_attribute(file, target, "NORMAL", 3, primitive.positions)});
  if (const auto indices = file.member(at, "indices")) primitive.indices = read_indices(file, *indices);
  if (const auto material = file.member(at, "material")) primitive.material = read_material_name(file, *material);
  primitives.push_back(primitive);
}

/// Positions of the n-th triangle's corners in the list of indices (section 3.7.2.1).
std::array<std::size_t, 3> corners_of(Primitive::Mode mode, std::size_t n) {
  if (mode == Primitive::Mode::triangles) return {3 * n, 3 * n + 1, 3 * n + 2};
  if (mode == Primitive::Mode::fan) return {n + 1, n + 2, 0};
  return {n, n + 1 + n % 2, n + 2 - n % 2};  // every second triangle of a strip has the opposite winding
}

/// Triangles as rows of the accessors.
std::vector<Corners> row_triangles(const Primitive& primitive) {
  const std::size_t positions = primitive.positions->count;
  std::vector<Corners> triangles(primitive.triangles());
  for (std::size_t n = 0; n < triangles.size(); ++n) {
    const auto along = corners_of(primitive.mode, n);
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t row =
          primitive.indices != nullptr ? primitive.indices->index(along[i]) : static_cast<std::uint32_t>(along[i]);
      if (row >= positions)
        refuse(primitive.at, "its index " + std::to_string(along[i]) + " must be one of the " +
                                 std::to_string(positions) + " positions, got " + std::to_string(row));
      triangles[n][i] = row;
    }
  }
  return triangles;
}

Vec3 vector(const Accessor& accessor, std::size_t row) {
  return {accessor.value(row, 0), accessor.value(row, 1), accessor.value(row, 2)};
}

/// A node's transform of points and normals.
class VertexTransform {
 public:
  explicit VertexTransform(const tracer::Transform& transform) : rows_(transform.rows) {
    for (std::size_t i = 0; i < 3; ++i) {
      const auto &a = rows_[(i + 1) % 3], &b = rows_[(i + 2) % 3];
      for (std::size_t j = 0; j < 3; ++j)
        cofactors_[i][j] = a[(j + 1) % 3] * b[(j + 2) % 3] - a[(j + 2) % 3] * b[(j + 1) % 3];
    }
    determinant_ = rows_[0][0] * cofactors_[0][0] + rows_[0][1] * cofactors_[0][1] + rows_[0][2] * cofactors_[0][2];
  }

  /// True if the winding of triangles is reversed (section 3.7.4).
  [[nodiscard]] bool mirrors() const { return determinant_ < 0; }

  [[nodiscard]] Vec3 point(const Vec3& p) const {
    const auto along = [&](const std::array<double, 4>& r) { return r[0] * p.x + r[1] * p.y + r[2] * p.z + r[3]; };
    return {along(rows_[0]), along(rows_[1]), along(rows_[2])};
  }

  /// The normal times the inverse transpose, which is the cofactors over the determinant; of any length. Zero if there
  /// is no inverse.
  [[nodiscard]] Vec3 normal(const Vec3& n) const {
    const double sign = determinant_ < 0 ? -1 : 1;
    const auto along = [&](const std::array<double, 3>& c) { return sign * (c[0] * n.x + c[1] * n.y + c[2] * n.z); };
    const Vec3 turned{along(cofactors_[0]), along(cofactors_[1]), along(cofactors_[2])};
    const double largest = std::max({std::abs(turned.x), std::abs(turned.y), std::abs(turned.z)});
    if (!(largest > 0)) return {};
    return {turned.x / largest, turned.y / largest, turned.z / largest};
  }

 private:
  std::array<std::array<double, 4>, 3> rows_;
  std::array<std::array<double, 3>, 3> cofactors_{};
  double determinant_ = 0;
};

bool within(const Vec3& v, double most) {  // false for NaN too
  return std::abs(v.x) <= most && std::abs(v.y) <= most && std::abs(v.z) <= most;
}

/// The attribute, moved by morph targets (section 3.7.2.2).
Vec3 morphed(const Primitive& primitive, const Accessor& attribute, const Accessor* Primitive::MorphTarget::*of,
             std::size_t row, const std::vector<double>& weights) {
  Vec3 value = vector(attribute, row);
  for (std::size_t i = 0; i < std::min(primitive.targets.size(), weights.size()); ++i) {
    const Accessor* const target = primitive.targets[i].*of;
    if (target == nullptr || weights[i] == 0) continue;
    const Vec3 difference = vector(*target, row);
    value = {value.x + weights[i] * difference.x, value.y + weights[i] * difference.y,
             value.z + weights[i] * difference.z};
  }
  return value;
}

/// The mean of the vertex's joints (section 3.7.3.1).
tracer::Transform skinned(const Primitive& primitive, std::size_t row, const std::vector<tracer::Transform>& joints) {
  tracer::Transform mean{.rows = {}};
  double sum = 0;
  for (std::size_t i = 0; i < 4; ++i) sum += primitive.weights->value(row, i);
  for (std::size_t i = 0; i < 4; ++i) {
    const double weight = sum > 0 ? primitive.weights->value(row, i) / sum : i == 0 ? 1 : 0;
    if (weight == 0) continue;
    const auto joint = static_cast<std::size_t>(primitive.joints->value(row, i));
    if (joint >= joints.size())
      refuse(primitive.at, "the vertex " + std::to_string(row) + " has the joint " + std::to_string(joint) +
                               ", its skin has " + std::to_string(joints.size()));
    for (std::size_t r = 0; r < 3; ++r)
      for (std::size_t c = 0; c < 4; ++c) mean.rows[r][c] += weight * joints[joint].rows[r][c];
  }
  return mean;
}

bool append_vertex(const Primitive& primitive, std::size_t row, const VertexTransform& transform,
                   const std::vector<double>& weights, const tracer::Limits& limits, tracer::Mesh& mesh) {
  using Target = Primitive::MorphTarget;
  mesh.positions.push_back(transform.point(morphed(primitive, *primitive.positions, &Target::positions, row, weights)));
  bool valid = within(mesh.positions.back(), limits.coordinate_max);
  if (primitive.normals != nullptr) {
    const Vec3 written = morphed(primitive, *primitive.normals, &Target::normals, row, weights);
    mesh.normals.push_back(transform.normal(written));
    valid &= within(written, limits.coordinate_max) && within(mesh.normals.back(), 1);
  }
  if (primitive.uvs != nullptr) {
    // Section 3.8.2: v runs down from the image's upper edge.
    mesh.uvs.push_back({primitive.uvs->value(row, 0), 1 - primitive.uvs->value(row, 1)});
    valid &= within({mesh.uvs.back().x, mesh.uvs.back().y, 0}, limits.value_max);
  }
  return valid;
}

/// An attribute that only some parts have is zero in the others: no normal, the texture's corner.
void fill_attributes(tracer::Mesh& mesh, bool normals, bool uvs, std::size_t vertices) {
  if (normals || !mesh.normals.empty()) mesh.normals.resize(vertices);
  if (uvs || !mesh.uvs.empty()) mesh.uvs.resize(vertices);
}

}  // namespace

std::uint64_t Primitive::triangles() const {
  const std::uint64_t corners = indices != nullptr ? indices->count : positions->count;
  return mode == Mode::triangles ? corners / 3 : corners < 3 ? 0 : corners - 2;
}

std::vector<Primitive> read_primitives(File& file, const Cursor& mesh) {
  std::vector<Primitive> primitives;
  for (const Cursor& element : file.elements(file.required_member(mesh, "primitives")))
    read_primitive(file, element, primitives);
  return primitives;
}

void append_primitive(const Primitive& primitive, const Placement& placement, const tracer::Limits& limits,
                      tracer::Mesh& mesh) {
  const std::vector<Corners> triangles = row_triangles(primitive);
  // Sorted, not a table of all rows: a part may use few of very many.
  std::vector<std::uint32_t> used;
  used.reserve(3 * triangles.size());
  for (const Corners& triangle : triangles) used.insert(used.end(), triangle.begin(), triangle.end());
  std::ranges::sort(used);
  used.erase(std::unique(used.begin(), used.end()), used.end());

  if (!triangles.empty()) tracer::begin_part(mesh, primitive.material);
  const bool has_skin = !placement.joints.empty() && primitive.joints != nullptr && primitive.weights != nullptr;
  const VertexTransform rigid(has_skin ? skinned(primitive, 0, placement.joints) : placement.world_from_node);
  const std::size_t first = mesh.positions.size();
  fill_attributes(mesh, primitive.normals != nullptr, primitive.uvs != nullptr, first);
  for (const std::uint32_t row : used) {
    const VertexTransform own = has_skin ? VertexTransform(skinned(primitive, row, placement.joints)) : rigid;
    if (!append_vertex(primitive, row, own, placement.weights, limits, mesh))
      refuse(primitive.at,
             "the vertex " + std::to_string(row) + " is not finite, or beyond the limit coordinate_max or value_max");
  }
  fill_attributes(mesh, primitive.normals != nullptr, primitive.uvs != nullptr, mesh.positions.size());
  for (Corners triangle : triangles) {
    for (std::uint32_t& corner : triangle) {
      const auto found = std::ranges::lower_bound(used, corner) - used.begin();
      corner = static_cast<std::uint32_t>(first + static_cast<std::size_t>(found));
    }
    if (rigid.mirrors()) std::swap(triangle[1], triangle[2]);
    mesh.triangles.push_back(triangle);
  }
}

}  // namespace api::gltf
