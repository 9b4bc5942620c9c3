#include "tracer/scene_cache.h"

#include <chrono>
#include <set>
#include <type_traits>
#include <utility>

#include "tracer/sha256.h"
#include "tracer/src/compile/scene_cache_entry.h"
#include "tracer/src/materials/compiled_material.h"
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
      const auto& [shape, material, transform, shadow] = object;
      add(shape.index());
      std::visit(*this, shape);
      add_material(material);
      add(transform.has_value());
      if (transform) add(transform->rows);
      add(shadow);
    }
  }

  template <HasFields S>
  void operator()(const S& shape) {
    for_each_field<S>([&](const auto& field) { add(shape.*field.member); });
  }
  void operator()(const Mesh& mesh) {
    const auto& [positions, triangles, normals, uvs, smooth, file, parts, part_materials, continues_polygon, time] =
        mesh;
    all(positions, triangles, normals, uvs, smooth, file.has_value(), continues_polygon, time.has_value(),
        time.value_or(0));
    is_known_ = is_known_ && part_materials.empty();  // its objects are known after the file is read
    if (!file) return;
    has_files_ = true;
    add_content(*file);
    if (file->index < scene_.assets.size())
      for (const AssetId buffer : scene_.assets[file->index].buffers) add_content(buffer);
  }
  void operator()(const Instance& instance) {
    const auto& [of, material] = instance;
    all(of.index, material.has_value());
    if (material) add_material(*material);
  }

  [[nodiscard]] bool is_known() const { return is_known_; }
  [[nodiscard]] bool has_files() const { return has_files_; }
  [[nodiscard]] std::uint64_t bytes() const { return hash_.size_bytes(); }
  std::string end() { return hash_.digest(); }

 private:
  void add_content(AssetId file) {
    const std::string content = file.index < contents_.size() ? contents_[file.index] : std::string();
    is_known_ = is_known_ && !content.empty();
    add(content.size());
    hash_.add(content.data(), content.size());
  }

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
  void add_material(MaterialId material) {
    const bool is_one = material.index < scene_.materials.size();  // an instance's object has none
    add(is_one && lets_light_pass(scene_.materials[material.index]));
    add(is_one && scene_.materials[material.index].shading == Material::Shading::flat_polygon);
  }

  const Scene& scene_;
  const std::vector<std::string>& contents_;
  Sha256 hash_;
  bool is_known_ = true, has_files_ = false;
};

/// Cache key of a scene's geometry: SHA-256 of all objects and prototypes, with `contents` in place of mesh files.
/// Equal only for scenes with the same geometry. Nothing if the content of a mesh file is unknown, or if there are so
/// few shapes that building them is faster than hashing.
std::optional<std::string> geometry_hash(const Scene& scene, const std::vector<std::string>& contents) {
  HashWriter writer(scene, contents);
  writer.objects(scene.objects);
  for (const Prototype& prototype : scene.prototypes) writer.objects(prototype.objects);
  const bool may_be_much =
      writer.has_files() || !scene.prototypes.empty() || writer.bytes() >= SceneCache::worthwhile_bytes;
  if (!writer.is_known() || !may_be_much) return std::nullopt;
  return writer.end();
}

/// Empty if the content of a file is unknown. A background may turn with the camera.
std::string radiosity_key(const Scene& scene, const std::vector<std::string>& contents,
                          const std::string& everything_but_the_view) {
  if (everything_but_the_view.empty()) return {};
  Sha256 hash;
  const auto add = [&](const std::string& text) {
    const std::uint64_t size = text.size();
    hash.add(&size, sizeof size);
    hash.add(text.data(), text.size());
  };
  add(everything_but_the_view);
  for (std::size_t i = 0; i < scene.assets.size(); ++i) {
    if (i >= contents.size() || contents[i].empty()) return {};
    add(contents[i]);
  }
  static_assert(is_plain<Vec3>);
  const Vec3 up = scene.background.up.value_or(scene.camera.up);
  hash.add(&up, sizeof up);
  return hash.digest();
}

/// Removes the file names of meshes whose triangles are already in `geometry`. The meshes stay empty, and `smooth` is
/// set to whether they have normals, because `requirements` uses it.
void replace_file_meshes(Scene& scene, const GeometrySet& geometry) {
  std::set<const Shape*> with_normals;
  std::size_t placed_meshes = 0;
  for_each_placed(scene, [&](const Placed& placed) {
    if (!std::holds_alternative<Mesh>(placed.shape)) return;
    if (geometry.mesh_has_normals[placed_meshes++]) with_normals.insert(&placed.shape);
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

}  // namespace

LruCache::BuildTicket::~BuildTicket() {
  if (cache_ && !found_) cache_->release_ticket(key_, nullptr, 0);
}

void LruCache::BuildTicket::store(Value value, std::uint64_t bytes) {
  const std::shared_ptr<LruCache> cache = std::move(cache_);
  cache->release_ticket(key_, std::move(value), bytes);
}

Result<LruCache::BuildTicket, Failure> LruCache::acquire(const Key& key, const RenderControl& control) {
  constexpr std::chrono::milliseconds poll_interval{10};  // RenderControl has no callback
  std::unique_lock lock(mutex_);
  for (;;) {
    const auto [entry, is_new] = entries_.try_emplace(key);
    if (is_new) return BuildTicket(shared_from_this(), key, nullptr);
    if (entry->second.value) {
      entry->second.used = ++uses_;
      return BuildTicket(shared_from_this(), key, entry->second.value);
    }
    if (control.cancelled()) return Failure{Failure::Code::cancelled, "cancelled while another scene built the same"};
    released_.wait_for(lock, poll_interval);
  }
}

/// A null or too large value is not stored: the next waiting caller builds it.
void LruCache::release_ticket(const Key& key, Value value, std::uint64_t bytes) {
  const std::lock_guard lock(mutex_);
  if (value && bytes <= bytes_max_) {
    while (bytes_ > bytes_max_ - bytes) evict_oldest();
    entries_[key] = {std::move(value), bytes, ++uses_};
    bytes_ += bytes;
  } else {
    entries_.erase(key);
  }
  released_.notify_all();
}

/// Precondition: bytes_ > 0.
void LruCache::evict_oldest() {
  auto oldest = entries_.end();
  for (auto entry = entries_.begin(); entry != entries_.end(); ++entry)
    if (entry->second.value && (oldest == entries_.end() || entry->second.used < oldest->second.used)) oldest = entry;
  bytes_ -= oldest->second.bytes;
  entries_.erase(oldest);
}

void LruCache::clear() {
  const std::lock_guard lock(mutex_);
  while (bytes_ > 0) evict_oldest();
}

std::uint64_t LruCache::memory_bytes(Kind kind) const {
  const std::lock_guard lock(mutex_);
  std::uint64_t bytes = 0;
  for (const auto& [key, entry] : entries_)
    if (key.kind == kind) bytes += entry.bytes;
  return bytes;
}

SceneCache::SceneCache(std::uint64_t bytes_max) : cache_(std::make_shared<LruCache>(bytes_max)) {}
SceneCache::~SceneCache() = default;

void SceneCache::clear() { cache_->clear(); }

SceneCache::Bytes SceneCache::memory_bytes() const {
  using enum LruCache::Kind;
  return {cache_->memory_bytes(geometry), cache_->memory_bytes(image), cache_->memory_bytes(radiosity)};
}

Result<std::shared_ptr<SceneCacheEntry>, Failure> SceneCache::acquire(Scene& scene, std::vector<std::string> contents,
                                                                      const RenderControl& control,
                                                                      const std::string& everything_but_the_view) {
  if (cache_->bytes_max() == 0)
    return std::make_shared<SceneCacheEntry>(cache_, std::vector<std::string>(), std::nullopt, std::string());
  std::string patches = radiosity_key(scene, contents, everything_but_the_view);
  const auto name = geometry_hash(scene, contents);
  if (!name) return std::make_shared<SceneCacheEntry>(cache_, std::move(contents), std::nullopt, std::move(patches));
  auto ticket = cache_->acquire({LruCache::Kind::geometry, *name}, control);
  if (!ticket) return ticket.error();
  auto entry = std::make_shared<SceneCacheEntry>(cache_, std::move(contents), std::move(*ticket), std::move(patches));
  if (const CachedGeometry* cached = entry->geometry()) replace_file_meshes(scene, cached->accelerator->geometry());
  return entry;
}

const CachedGeometry* SceneCacheEntry::geometry() const {
  return geometry_ ? static_cast<const CachedGeometry*>(geometry_->found().get()) : nullptr;
}

void SceneCacheEntry::store(const CachedGeometry& geometry) {
  if (!geometry_) return;
  const GeometrySet& set = geometry.accelerator->geometry();
  // The render space of a scene with planes only depends on the camera.
  const bool has_place = !set.spheres.empty() || !set.triangles.empty() || !set.quadrics.empty();
  if (has_place && tracer::memory_bytes(set) >= SceneCache::worthwhile_bytes)
    geometry_->store(std::make_shared<const CachedGeometry>(geometry), geometry.accelerator->memory_bytes());
  geometry_.reset();
}

Result<std::optional<LruCache::BuildTicket>, Failure> SceneCacheEntry::image(const ImageTexture& texture,
                                                                             const RenderControl& control) {
  const std::uint32_t file = texture.file.index;
  if (file >= contents_.size() || contents_[file].empty()) return std::optional<LruCache::BuildTicket>();
  const auto& space = texture.color_space;
  const char color_space = !space ? 'd' : *space == ColorSpace::linear ? 'l' : 's';
  const std::string read_as{color_space, static_cast<char>('0' + static_cast<int>(texture.channel))};
  auto ticket = cache_->acquire({LruCache::Kind::image, read_as + contents_[file]}, control);
  if (!ticket) return ticket.error();
  return std::optional<LruCache::BuildTicket>(std::move(*ticket));
}

Result<std::optional<LruCache::BuildTicket>, Failure> SceneCacheEntry::radiosity(const std::string& stage,
                                                                                 const RenderControl& control) {
  if (radiosity_key_.empty()) return std::optional<LruCache::BuildTicket>();
  auto ticket = cache_->acquire({LruCache::Kind::radiosity, radiosity_key_ + stage}, control);
  if (!ticket) return ticket.error();
  return std::optional<LruCache::BuildTicket>(std::move(*ticket));
}

void SceneCacheEntry::store(LruCache::BuildTicket ticket, const std::shared_ptr<const ImageMap>& image) {
  const std::uint64_t bytes = image->memory_bytes();
  if (bytes >= SceneCache::worthwhile_bytes) ticket.store(image, bytes);
}

}  // namespace tracer
