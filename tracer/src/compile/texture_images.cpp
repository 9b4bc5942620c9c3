#include <map>
#include <set>
#include <utility>

#include "tracer/src/compile/compile_steps.h"
#include "tracer/src/image_io/decode.h"

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
  auto decoded = decode(bytes, texture.color_space, {});
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
    if (const auto* texture = std::get_if<TextureId>(&material.color)) used.insert(texture->index);
    if (material.bump) used.insert(material.bump->texture.index);
  }
  return used;
}

}  // namespace

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

Result<TextureImages, Failure> texture_images(const std::vector<Texture>& textures, const std::vector<Asset>& assets,
                                              const Assets& content, const RenderControl& control,
                                              SceneCacheEntry* cache_entry, CacheHits& cache_hits) {
  using Key = std::pair<std::uint32_t, std::optional<ColorSpace>>;
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
    SharedImageMap& image = made[{index, pattern->color_space}];
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

}  // namespace tracer
