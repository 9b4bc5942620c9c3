#include "tracer/src/compile/geometry_hash.h"

#include <set>
#include <type_traits>

#include "tracer/scene_cache.h"
#include "tracer/sha256.h"
#include "tracer/src/scene/instancing.h"

namespace tracer {
namespace {

/// Types without padding: values are equal if their bytes are.
template <class T>
constexpr bool is_plain = std::is_arithmetic_v<T>;
template <>
constexpr bool is_plain<Vec2> = sizeof(Vec2) == 2 * sizeof(double);
template <>
constexpr bool is_plain<Vec3> = sizeof(Vec3) == 3 * sizeof(double);
template <class T, std::size_t n>
constexpr bool is_plain<std::array<T, n>> = is_plain<T>;

/// Feeds scenes to the hash. Structured bindings name every field, so a new field does not compile until it is added.
/// Everything of variable length is preceded by its length: no two scenes give the same bytes.
class HashWriter {
 public:
  HashWriter(const Scene& scene, const std::vector<std::string>& contents) : scene_(scene), contents_(contents) {}

  void objects(const std::vector<Object>& objects) {
    add(objects.size());
    for (const Object& object : objects) {
      const auto& [shape, material, transform] = object;
      add(shape.index());
      std::visit(*this, shape);
      is_transmissive(material);
      add(transform.has_value());
      if (transform) add(transform->rows);
    }
  }

  template <HasFields S>
  void operator()(const S& shape) {
    for_each_field<S>([&](const auto& field) { add(shape.*field.member); });
  }
  void operator()(const Mesh& mesh) {
    const auto& [positions, triangles, normals, uvs, smooth, file] = mesh;
    all(positions, triangles, normals, uvs, smooth, file.has_value());
    if (!file) return;
    has_files_ = true;
    const std::string content = file->index < contents_.size() ? contents_[file->index] : std::string();
    is_known_ = is_known_ && !content.empty();
    add(content.size());
    hash_.add(content.data(), content.size());
  }
  void operator()(const Instance& instance) {
    const auto& [of, material] = instance;
    all(of.index, material.has_value());
    if (material) is_transmissive(*material);
  }

  [[nodiscard]] bool is_known() const { return is_known_; }
  [[nodiscard]] bool has_files() const { return has_files_; }
  [[nodiscard]] std::uint64_t bytes() const { return hash_.size_bytes(); }
  std::string end() { return hash_.digest(); }

 private:
  template <class... Values>
  void all(const Values&... values) {
    (add(values), ...);
  }
  template <class T>
  void add(const T& value) {
    static_assert(is_plain<T>);
    hash_.add(&value, sizeof value);
  }
  template <class T>
  void add(const std::optional<T>& value) {
    add(value.has_value());
    if (value) add(*value);
  }
  template <class T>
  void add(const std::vector<T>& values) {
    static_assert(is_plain<T>);
    add(values.size());
    hash_.add(values.data(), values.size() * sizeof(T));
  }
  void is_transmissive(MaterialId material) {
    const bool is_one = material.index < scene_.materials.size();  // an instance's object has none
    add(is_one && scene_.materials[material.index].transmission > 0);
  }

  const Scene& scene_;
  const std::vector<std::string>& contents_;
  Sha256 hash_;
  bool is_known_ = true, has_files_ = false;
};

}  // namespace

std::optional<std::string> geometry_hash(const Scene& scene, const std::vector<std::string>& contents) {
  HashWriter writer(scene, contents);
  writer.objects(scene.objects);
  for (const Prototype& prototype : scene.prototypes) writer.objects(prototype.objects);
  const bool may_be_much =
      writer.has_files() || !scene.prototypes.empty() || writer.bytes() >= SceneCache::worthwhile_bytes;
  if (!writer.is_known() || !may_be_much) return std::nullopt;
  return writer.end();
}

void replace_file_meshes(Scene& scene, const GeometrySet& geometry) {
  std::set<const Shape*> with_normals;
  std::size_t placed_meshes = 0;  // which come first of the geometry's triangles, in this order
  for_each_placed(scene, [&](const Placed& placed) {
    if (!std::holds_alternative<Mesh>(placed.shape)) return;
    if (!geometry.triangles[placed_meshes++].normals.empty()) with_normals.insert(&placed.shape);
  });
  const auto replace = [&](std::vector<Object>& objects) {
    for (Object& object : objects) {
      auto* mesh = std::get_if<Mesh>(&object.shape);
      if (mesh == nullptr || !mesh->file) continue;
      mesh->file.reset();
      mesh->smooth = with_normals.contains(&object.shape);
    }
  };
  replace(scene.objects);
  for (Prototype& prototype : scene.prototypes) replace(prototype.objects);
}

}  // namespace tracer
