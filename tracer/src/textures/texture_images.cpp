#include "tracer/src/textures/texture_images.h"

#include <map>
#include <utility>

#include "tracer/src/image_io/decode.h"

namespace tracer {

Result<TextureImages, Failure> texture_images(const Scene& scene, const Assets& assets) {
  using Key = std::pair<std::uint32_t, std::optional<ColorSpace>>;
  std::map<Key, std::shared_ptr<const ImageMap>> made;
  TextureImages images;
  images.reserve(scene.textures.size());
  for (const Texture& texture : scene.textures) {
    const auto* picture = std::get_if<ImageTexture>(&texture.pattern);
    if (picture == nullptr) {
      images.emplace_back();
      continue;
    }
    const std::uint32_t index = picture->file.index;
    std::shared_ptr<const ImageMap>& image = made[{index, picture->color_space}];
    if (!image) {
      std::span<const std::uint8_t> bytes;
      if (index < assets.bytes.size()) bytes = assets.bytes[index];
      auto decoded = decode(bytes, picture->color_space, {});
      if (!decoded) {
        return Failure{Failure::Code::bad_asset, scene.assets[index].name + ": " + decoded.error(),
                       texture.path + "/file"};
      }
      image = std::make_shared<const ImageMap>(std::move(*decoded));
    }
    images.push_back(image);
  }
  return images;
}

}  // namespace tracer
