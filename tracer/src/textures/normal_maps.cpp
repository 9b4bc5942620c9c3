#include "tracer/src/textures/normal_maps.h"

#include <map>
#include <set>

namespace tracer {
namespace {

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

}  // namespace tracer
