#include "tracer/compile.h"

#include <algorithm>
#include <map>
#include <new>
#include <set>
#include <tuple>
#include <utility>

#include "tracer/src/compile/compile_steps.h"
#include "tracer/src/compile/scene_cache_entry.h"
#include "tracer/src/image_io/decode.h"
#include "tracer/src/interaction/surface.h"
#include "tracer/src/lights/light_registry.h"
#include "tracer/src/materials/compiled_material.h"
#include "tracer/src/textures/texture.h"

namespace tracer {
namespace {

using SharedImageMap = std::shared_ptr<const ImageMap>;

/// From the cache, or decoded.
Result<SharedImageMap, Failure> image_of(const ImageTexture& texture, std::span<const std::uint8_t> bytes,
                                         const std::string& name, const std::string& path, const RenderControl& control,
                                         SceneCacheEntry* cache_entry, CacheHits& cache_hits) {
  std::optional<LruCache::BuildTicket> ticket;
  if (cache_entry != nullptr) {
    auto mine = cache_entry->image(texture, control);
    if (!mine) return mine.error();
    if (*mine) ticket.emplace(std::move(**mine));
  }
  if (ticket && ticket->found()) {
    ++cache_hits.textures;
    return std::static_pointer_cast<const ImageMap>(ticket->found());
  }
  auto decoded = decode(bytes, texture.color_space, {}, texture.channel);
  if (!decoded) return Failure{Failure::Code::bad_asset, name + ": " + decoded.error(), path + "/file"};
  auto made = std::make_shared<const ImageMap>(std::move(*decoded));
  ++cache_hits.decoded_textures;
  if (ticket) SceneCacheEntry::store(*std::move(ticket), made);
  return made;
}

std::set<std::uint32_t> textures_used_as_colors(const Background& background, const std::vector<Material>& materials) {
  std::set<std::uint32_t> used;
  if (background.environment) used.insert(background.environment->texture.index);
  if (background.cube)
    for (const TextureId face : background.cube->faces) used.insert(face.index);
  for (const Material& material : materials) {
    for_each_color_texture(material, [&](TextureId texture) { used.insert(texture.index); });
    if (material.bump) used.insert(material.bump->texture.index);
  }
  return used;
}

/// Sets the color space of textures used as normal maps to linear if they have none. A texture that is also used as a
/// color or a height is unchanged, and normal maps use a copy appended to `textures`.
void read_normal_maps_as_linear(const Background& background, std::vector<Material>& materials,
                                std::vector<Texture>& textures) {
  std::map<std::uint32_t, TextureId> linear;  // copies, by the index of the original
  std::set<std::uint32_t> as_colors;
  for (Material& material : materials) {
    if (!material.normal_map) continue;
    const std::uint32_t index = material.normal_map->index;
    const auto* image = std::get_if<ImageTexture>(&textures[index].pattern);
    if (image == nullptr || (image->color_space && !linear.contains(index))) continue;
    if (linear.empty()) as_colors = textures_used_as_colors(background, materials);
    const auto [place, is_new] = linear.try_emplace(index, *material.normal_map);
    if (is_new && as_colors.contains(index)) {
      place->second = {static_cast<std::uint32_t>(textures.size())};
      textures.emplace_back(textures[index]);
    }
    std::get<ImageTexture>(textures[place->second.index].pattern).color_space = ColorSpace::linear;
    material.normal_map = place->second;
  }
}

using TextureImages = std::vector<SharedImageMap>;

/// Decodes the image files of textures to mip maps: one element per texture, null for patterns; textures of the same
/// file in the same color space and channel share one image. Uses the cache unless `cache_entry` is null, and counts in
/// `cache_hits`. Fails with `bad_asset`, and between two files with `cancelled`.
Result<TextureImages, Failure> texture_images(const std::vector<Texture>& textures, const std::vector<Asset>& assets,
                                              const Assets& content, const RenderControl& control,
                                              SceneCacheEntry* cache_entry, CacheHits& cache_hits) {
  using Key = std::tuple<std::uint32_t, std::optional<ColorSpace>, ImageTexture::Channel>;
  std::map<Key, SharedImageMap> made;
  TextureImages images;
  images.reserve(textures.size());
  for (const Texture& texture : textures) {
    const auto* pattern = std::get_if<ImageTexture>(&texture.pattern);
    if (pattern == nullptr) {
      images.emplace_back();
      continue;
    }
    const std::uint32_t index = pattern->file.index;
    SharedImageMap& image = made[{index, pattern->color_space, pattern->channel}];
    if (!image) {
      if (control.cancelled()) return Failure{Failure::Code::cancelled, "cancelled while decoding"};
      std::span<const std::uint8_t> bytes;
      if (index < content.bytes.size()) bytes = content.bytes[index];
      auto found = image_of(*pattern, bytes, assets[index].name, texture.path, control, cache_entry, cache_hits);
      if (!found) return found.error();
      image = *std::move(found);
    }
    images.push_back(image);
  }
  return images;
}

/// A transmissive object whose back face a ray from the camera hits before its front face.
struct BackFaceHit {
  std::uint32_t object = 0;
  bool plane = false;
};

std::vector<BackFaceHit> find_back_face_hits(const CompiledScene& scene, const RenderControl& control, Vec3 origin,
                                             const Vec3& direction) {
  std::vector<BackFaceHit> hits;
  std::set<std::uint32_t> visited;
  PrimitiveRef from;
  for (std::uint64_t crossing = 0; crossing < scene.accelerator->max_transmissive_hits() && !control.cancelled();
       ++crossing) {
    Hit hit;
    scene.accelerator->intersect(
        {&origin.x, &origin.y, &origin.z, &direction.x, &direction.y, &direction.z, nullptr, &from, 1},
        {&hit.primitive, &hit.t, &hit.u, &hit.v}, Coherence::incoherent, GeometryMask::transmissive);
    if (!hit.primitive.hit()) break;
    const Surface surface = surface_at(scene, hit, origin, direction);
    const bool has_medium = scene.objects.boundary[surface.object] != MediumBoundary::none;
    if (has_medium && visited.insert(surface.object).second && surface.back)
      hits.push_back({surface.object, hit.primitive.geometry == scene.geometry().plane_geometry()});
    origin = offset_origin(surface.point, surface.geometric_normal, direction);
    from = hit.primitive;
  }
  return hits;
}

/// Transmissive solids that contain the camera, outermost first: those with a back-face hit both in front of and behind
/// the camera; a disc or an inverted hollow has one on one side at most. A plane has one side only. The center of an
/// orthographic window or of a lens decides for all of it.
std::vector<std::uint32_t> media_enclosing_camera(const CompiledScene& scene, const RenderControl& control) {
  const auto [origin, ahead] = scene.camera.generate_ray(0.5 * scene.camera.columns(), 0.5 * scene.image.height);
  std::vector<BackFaceHit> outermost_first = find_back_face_hits(scene, control, origin, ahead);
  std::reverse(outermost_first.begin(), outermost_first.end());
  const std::vector<BackFaceHit> after = find_back_face_hits(scene, control, origin, -ahead);
  std::vector<std::uint32_t> enclosing;
  for (const BackFaceHit& hit : outermost_first) {
    const auto same = [&](const BackFaceHit& other) { return other.object == hit.object; };
    if (hit.plane || std::any_of(after.begin(), after.end(), same)) enclosing.push_back(hit.object);
  }
  return enclosing;
}

/// Builds the accelerator of `geometry`, or returns the cached one.
Result<std::shared_ptr<const Accelerator>, Failure> accelerator_over(GeometrySet geometry, const FiniteBounds& bounds,
                                                                     RenderControl& control,
                                                                     SceneCacheEntry* cache_entry) {
  if (cache_entry != nullptr && cache_entry->geometry() != nullptr) return cache_entry->geometry()->accelerator;
  drop_duplicates(geometry);
  auto built = Accelerator::build(std::move(geometry), control);
  if (built && cache_entry != nullptr) cache_entry->store({*built, bounds});
  return built;
}

Color color_bound(const CompiledScene& scene, const ColorOrTexture& color) {
  const auto* id = std::get_if<TextureId>(&color);
  if (id == nullptr) return std::get<Color>(color);
  const double bound = texture_bound(scene.textures[id->index], scene.images[id->index].get());
  return {bound, bound, bound};
}

/// Image files may be brighter than validate() could assume.
std::optional<Failure> find_excess_of_light(const CompiledScene& scene) {
  for (const std::uint32_t index :
       std::set<std::uint32_t>(scene.objects.material.begin(), scene.objects.material.end())) {
    const Material& material = scene.materials[index];
    const auto excess =
        excess_of_light(material, [&](const ColorOrTexture& color) { return color_bound(scene, color); });
    if (excess) return Failure{Failure::Code::bad_asset, "the texture of a material: it " + *excess, material.path};
  }
  return std::nullopt;
}

/// Precondition: the accelerator and the background are set.
Emitters emitters_of(const CompiledScene& scene, SkyOpenings openings = {}) {
  std::vector<float> radiance;
  radiance.reserve(scene.objects.material.size());
  for (const std::uint32_t material : scene.objects.material)
    radiance.push_back(static_cast<float>(max_component(color_bound(scene, scene.materials[material].emission))));
  return {scene.geometry(), radiance, SkyTable(*scene.background), std::move(openings)};
}

template <class T>
std::uint64_t bytes_of(const std::vector<T>& values) {
  return values.capacity() * sizeof(T);
}

/// `taken`: the scene's objects, whose meshes may be moved from; null: nothing may.
Result<std::shared_ptr<const CompiledScene>, Failure> compile(const Scene& scene, std::vector<Object>* taken,
                                                              RenderControl& control, const Assets& assets,
                                                              SceneCacheEntry* cache_entry,
                                                              const std::function<double()>& elapsed_ms) {
  if (control.cancelled()) return Failure{Failure::Code::cancelled, "cancelled before building"};
  try {
    const CachedGeometry* const cached = cache_entry != nullptr ? cache_entry->geometry() : nullptr;
    const FiniteBounds bounds = cached != nullptr ? cached->bounds : finite_bounds(scene);
    auto compiled = std::make_shared<CompiledScene>(scene, RenderSpace(bounds));
    if (compiled->needs.bump) read_normal_maps_as_linear(scene.background, compiled->materials, compiled->textures);
    compiled->cache_hits.geometry = cached != nullptr;
    auto images = texture_images(compiled->textures, scene.assets, assets, control, cache_entry, compiled->cache_hits);
    if (!images) return images.error();
    compiled->images = std::move(*images);
    compiled->background.emplace(scene.background, scene.background.up.value_or(scene.camera.up), compiled->textures,
                                 compiled->images);
    if (control.cancelled()) return Failure{Failure::Code::cancelled, "cancelled before building"};
    // Also needed with a cached accelerator: it assigns the materials and axes of objects.
    GeometrySet geometry = build_geometry(scene, *compiled, taken, control);
    if (control.cancelled()) return Failure{Failure::Code::cancelled, "cancelled while placing shapes"};
    if (compiled->exact.needs.global_light)
      if (auto excess = find_excess_of_light(*compiled)) return *std::move(excess);
    for (const Light& light : scene.lights) compiled->lights.push_back(compile_light(light, compiled->frame));
    auto accelerator = accelerator_over(std::move(geometry), bounds, control, cache_entry);
    if (!accelerator) return accelerator.error();
    compiled->accelerator = *std::move(accelerator);
    if (compiled->exact.needs.emitters) compiled->objects.emitters = emitters_of(*compiled);
    if (compiled->exact.needs.refraction) compiled->media.enclosing_camera = media_enclosing_camera(*compiled, control);
    if (scene.accuracy.approximate.shadows == Approximations::Shadows::map)
      compiled->shadow_maps = render_shadow_maps(*compiled, bounds, control);
    if (scene.accuracy.uses_patches() && compiled->needs.global_light)
      if (auto failure = solve_radiosity(*compiled, bounds, {control, cache_entry, elapsed_ms}))
        return *std::move(failure);
    if (!scene.accuracy.uses_patches() && compiled->exact.needs.global_light)
      sample_sky_openings(*compiled, find_sky_openings(
                                         *compiled, [&] { return points_in_view(*compiled, control); }, control));
    if (control.cancelled()) return Failure{Failure::Code::cancelled, "cancelled while building"};
    return std::shared_ptr<const CompiledScene>(std::move(compiled));
  } catch (const std::bad_alloc&) {
    return Failure{Failure::Code::out_of_memory, "no memory for the compiled scene"};
  }
}

}  // namespace

Result<std::shared_ptr<const CompiledScene>, Failure> compile(const Scene& scene, RenderControl& control,
                                                              const Assets& assets, SceneCacheEntry* cache_entry,
                                                              const std::function<double()>& elapsed_ms) {
  return compile(scene, nullptr, control, assets, cache_entry, elapsed_ms);
}

Result<std::shared_ptr<const CompiledScene>, Failure> compile_taking_meshes(Scene& scene, RenderControl& control,
                                                                            const Assets& assets,
                                                                            SceneCacheEntry* cache_entry,
                                                                            const std::function<double()>& elapsed_ms) {
  return compile(scene, &scene.objects, control, assets, cache_entry, elapsed_ms);
}

void sample_sky_openings(CompiledScene& scene, const SkyOpenings& openings) {
  if (openings.empty()) return;
  scene.objects.emitters = emitters_of(scene, openings);
  for (Requirements* needs : {&scene.needs, &scene.exact.needs}) needs->emitters = needs->global_light;
}

CacheHits cache_hits(const CompiledScene& scene) { return scene.cache_hits; }

std::optional<RadiosityFigures> radiosity_figures(const CompiledScene& scene) {
  return scene.objects.radiosity == nullptr ? std::nullopt : std::optional(scene.objects.radiosity->figures);
}

std::uint64_t memory_bytes(const CompiledScene& scene) {
  std::uint64_t bytes = scene.accelerator->memory_bytes() + bytes_of(scene.lights) + bytes_of(scene.materials) +
                        bytes_of(scene.terms) + bytes_of(scene.exact.terms) + bytes_of(scene.objects.material) +
                        bytes_of(scene.objects.shadowless) + bytes_of(scene.objects.uv_axes) +
                        bytes_of(scene.objects.boundary) + bytes_of(scene.objects.diagonal) +
                        scene.objects.emitters.memory_bytes();
  for (const ShadowMap& map : scene.shadow_maps)
    for (const ShadowFace& face : map.faces) bytes += bytes_of(face.depth);
  if (scene.objects.radiosity != nullptr) bytes += scene.objects.radiosity->memory_bytes();
  std::set<const ImageMap*> images;  // textures may share one
  for (const auto& image : scene.images)
    if (image && images.insert(image.get()).second) bytes += image->memory_bytes();
  return bytes;
}

}  // namespace tracer
