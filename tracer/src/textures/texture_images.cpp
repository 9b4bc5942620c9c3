#include "tracer/src/textures/texture_images.h"

#include <map>
#include <utility>

#include "tracer/src/image_io/decode.h"

namespace tracer {

Result<TextureImages, Failure> texture_images(const std::vector<Texture>& textures, const std::vector<Asset>& assets,
                                              const Assets& content, const RenderControl& control) {
  using Key = std::pair<std::uint32_t, std::optional<ColorSpace>>;
  std::map<Key, std::shared_ptr<const ImageMap>> made;
  TextureImages images;
  images.reserve(textures.size());
  for (const Texture& texture : textures) {
    const auto* picture = std::get_if<ImageTexture>(&texture.pattern);
    if (picture == nullptr) {
      images.emplace_back();
      continue;
    }
    const std::uint32_t index = picture->file.index;
    std::shared_ptr<const ImageMap>& image = made[{index, picture->color_space}];
    if (!image) {
      if (control.cancelled()) return Failure{Failure::Code::cancelled, "cancelled while decoding"};
      std::span<const std::uint8_t> bytes;
      if (index < content.bytes.size()) bytes = content.bytes[index];
      auto decoded = decode(bytes, picture->color_space, {});
      if (!decoded) {
        return Failure{Failure::Code::bad_asset, assets[index].name + ": " + decoded.error(), texture.path + "/file"};
      }
      image = std::make_shared<const ImageMap>(std::move(*decoded));
    }
    images.push_back(image);
  }
  return images;
}

}  // namespace tracer
