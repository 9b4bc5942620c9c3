#include "tracer/src/textures/background.h"

#include <algorithm>
#include <numbers>

namespace tracer {
namespace {

constexpr double pi = std::numbers::pi;

/// Direction at the center of an environment texture, before rotation.
Vec3 middle_of(const Vec3& up) { return axes_across(up, {0, 0, -1}).e0; }

/// The world axis closest to `v`; among equals y, then z.
Vec3 nearest_axis(const Vec3& v) {
  const Vec3 size = abs(v);
  if (size.y >= size.x && size.y >= size.z) return {0, std::copysign(1.0, v.y), 0};
  if (size.z >= size.x) return {0, 0, std::copysign(1.0, v.z)};
  return {std::copysign(1.0, v.x), 0, 0};
}

/// An image that covers the circle once is periodic; one that is scaled or offset uses its texture's wrap mode.
Wraps wraps_around(const Texture& texture) {
  const bool to_the_poles = texture.scale.y == 1 && texture.offset.y == 0;
  return {texture.scale.x == 1 ? Texture::Wrap::repeat : texture.wrap,
          to_the_poles ? Texture::Wrap::clamp : texture.wrap};
}

Wraps wraps_on_face(const Texture& texture) {
  const bool whole = texture.scale == Vec2{1, 1} && texture.offset == Vec2{};
  return whole ? Wraps{Texture::Wrap::clamp, Texture::Wrap::clamp} : Wraps{texture.wrap, texture.wrap};
}

/// Maximum number of useful lookups along a full circle. The means of checkers and gradients are exact for every width.
double pieces_of_a_turn(const Texture& texture, const ImageMap* image) {
  const double turns = std::abs(texture.scale.x);
  if (image != nullptr) return turns * image->levels().front().width;
  const auto* noise = std::get_if<NoiseTexture>(&texture.pattern);
  return noise != nullptr ? turns * std::ldexp(4, static_cast<int>(noise->octaves)) : 1;
}

}  // namespace

CompiledBackground::CompiledBackground(const Background& background, const Vec3& up,
                                       const std::vector<Texture>& textures,
                                       const std::vector<std::shared_ptr<const ImageMap>>& images)
    : color_(background.color), up_(normalize(up)) {
  const auto add_face = [&](const Vec3& axis, const Vec3& face_up, TextureId id, Wraps (*wraps)(const Texture&)) {
    const Texture& texture = textures[id.index];
    faces_.push_back({axis, cross(axis, face_up), face_up, texture, images[id.index], wraps(texture)});
  };
  if (background.gradient) {
    kind_ = Kind::gradient;
    gradient_ = *background.gradient;
  } else if (background.environment) {
    kind_ = Kind::environment;
    const double angle = std::remainder(background.environment->rotation_deg, 360) * (pi / 180);
    const Vec3 middle = middle_of(up_);
    add_face(normalize(middle * std::cos(angle) + cross(up_, middle) * std::sin(angle)), up_,
             background.environment->texture, wraps_around);
  } else if (background.cube) {
    kind_ = Kind::cube;
    const Vec3 above = nearest_axis(up_), middle = middle_of(above);
    constexpr Vec3 axes[] = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}};
    for (std::size_t face = 0; face < 6; ++face) {
      const double along_up = dot(axes[face], above);
      add_face(axes[face], along_up == 0 ? above : middle * -along_up, background.cube->faces[face], wraps_on_face);
    }
  }
}

/// Equirectangular mapping, the inverse of the panorama camera. Near the poles the footprint of a ray is much wider
/// than high, which mip maps cannot represent: several adjacent lookups are averaged, so many that each is square on an
/// image twice as wide as high. Their number is 1 / cos(latitude), about 1.6 in the mean over all directions.
Color CompiledBackground::environment(const Vec3& direction, double spread) const {
  const Face& around = faces_.front();
  const double ahead = dot(direction, around.axis), right = dot(direction, around.right);
  const double level = std::hypot(ahead, right);
  const double turn = 0.5 + std::atan2(right, ahead) / (2 * pi);
  const Vec2 uv{turn - std::floor(turn), 0.5 + std::atan2(dot(direction, around.up), level) / pi};
  const Texture& texture = around.texture;
  const ImageMap* image = around.image.get();
  if (!(spread > 0) || texture.filter != Texture::Filter::mipmap) return radiance_at(uv);
  const double height = std::min(1.0, spread / pi);
  const double width = spread < 2 * pi * level ? spread / (2 * pi * level) : 1;
  constexpr double lookups_max = 1024;  // exceeded only in pixels that contain a pole
  const double wanted = std::min({2 * width / height, width * pieces_of_a_turn(texture, image), lookups_max});
  const auto lookups = static_cast<int>(std::max(1.0, std::nearbyint(wanted)));
  Color sum;
  for (int i = 0; i < lookups; ++i) {
    const double u = uv.x + width * ((i + 0.5) / lookups - 0.5);
    sum += texture_color(texture, lookup(texture, {u, uv.y}, {width / lookups, height}), image, around.wraps);
  }
  return sum * (1.0 / lookups);
}

/// Uses the face of the direction's largest component. There u = (1 + right / ahead) / 2, whose gradient over
/// directions has the length sqrt(1 + (right / ahead)^2) / (2 ahead); the same for v.
Color CompiledBackground::cube(const Vec3& direction, double spread) const {
  const Face* face = faces_.data();
  for (const Face& other : faces_)
    if (dot(direction, other.axis) > dot(direction, face->axis)) face = &other;
  const double ahead = dot(direction, face->axis);
  const double right = dot(direction, face->right) / ahead, up = dot(direction, face->up) / ahead;
  const auto covered = [&](double across) {
    return std::min(1.0, spread * std::sqrt(1 + across * across) / (2 * ahead));
  };
  return texture_color(face->texture,
                       lookup(face->texture, {(1 + right) / 2, (1 + up) / 2}, {covered(right), covered(up)}),
                       face->image.get(), face->wraps);
}

CompiledBackground::DirectionGrid CompiledBackground::grid() const {
  if (faces_.empty()) return {};
  const Face& face = faces_.front();
  const double faces = kind_ == Kind::cube ? 4 : 1;
  if (face.image == nullptr) return {face.axis, face.right, face.up, 512, 256};  // a pattern has a value everywhere
  const Image& image = face.image->levels().front();
  return {face.axis, face.right, face.up, faces * std::abs(face.texture.scale.x) * image.width,
          std::ceil(faces / 2) * std::abs(face.texture.scale.y) * image.height};
}

Color CompiledBackground::radiance_at(const Vec2& uv) const {
  const Face& face = faces_.front();
  if (kind_ == Kind::environment)
    return texture_color(face.texture, lookup(face.texture, uv, {}), face.image.get(), face.wraps);
  const double longitude = 2 * pi * (uv.x - 0.5), latitude = pi * (uv.y - 0.5);
  const Vec3 level = face.axis * std::cos(longitude) + face.right * std::sin(longitude);
  return radiance(level * std::cos(latitude) + face.up * std::sin(latitude), 0);
}

std::optional<CompiledBackground::Spot> CompiledBackground::brightest() const {
  if (kind_ != Kind::environment || faces_.front().image == nullptr) return std::nullopt;
  const Face& around = faces_.front();
  const Image& image = around.image->levels().front();
  const auto most = std::ranges::max_element(image.rgb);
  if (*most < 16 * *std::ranges::max_element(around.image->levels().back().rgb)) return std::nullopt;
  const std::size_t texel = static_cast<std::size_t>(most - image.rgb.begin()) / 3, x = texel % image.width,
                    y = texel / image.width;
  const auto is_bright = [&](std::size_t column, std::size_t row) {
    if (column >= image.width || row >= image.height) return false;
    const float* const at = &image.rgb[3 * (row * image.width + column)];
    return 2 * std::max({at[0], at[1], at[2]}) >= *most;
  };
  std::size_t right = 1, down = 1;  // it is the first of its row and column
  while (right < 16 && is_bright(x + right, y)) ++right;
  while (down < 16 && is_bright(x, y + down)) ++down;
  const Vec2 &scale = around.texture.scale, &offset = around.texture.offset;
  const auto direction = [&](double column, double row) {
    const double u = (static_cast<double>(x) + column) / image.width,
                 v = 1 - (static_cast<double>(y) + row) / image.height;
    const double longitude = 2 * pi * ((u - offset.x) / scale.x - 0.5),
                 latitude = pi * ((v - offset.y) / scale.y - 0.5);
    const Vec3 level = around.axis * std::cos(longitude) + around.right * std::sin(longitude);
    return level * std::cos(latitude) + around.up * std::sin(latitude);
  };
  const auto columns = static_cast<double>(right), rows = static_cast<double>(down);
  constexpr double beside = 0.3;  // texels are interpolated with those beside them
  return Spot{{direction(columns / 2, rows / 2), direction(-beside, -beside), direction(columns + beside, -beside),
               direction(-beside, rows + beside), direction(columns + beside, rows + beside)},
              pi / image.height * (std::max(columns, rows) + 1) / 2};
}

double CompiledBackground::bound() const {
  if (kind_ == Kind::color) return max_component(color_);
  if (kind_ == Kind::gradient) return std::max(max_component(gradient_.zenith), max_component(gradient_.nadir));
  double bound = 0;
  for (const Face& face : faces_) bound = std::max(bound, texture_bound(face.texture, face.image.get()));
  return bound;
}

}  // namespace tracer
