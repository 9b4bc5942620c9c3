#include "tracer/src/certify/color_range.h"

#include <numbers>

#include "tracer/src/interaction/surface.h"
#include "tracer/src/shapes/shape_registry.h"
#include "tracer/src/textures/texture.h"

namespace tracer {
namespace {

/// Texture coordinates of a patch, and the lengths of their gradients.
struct PatchUv {
  Interval u = all_numbers, v = all_numbers;
  double gradient_u = 0, gradient_v = 0;
  [[nodiscard]] bool bounded() const { return std::isfinite(u.low + u.high + v.low + v.high); }
};

/// spherical_uv() of unit normals about z, away from poles and seam: an angle differs from that of the center by at
/// most the arc sine of the distance over the radius.
PatchUv spherical_range(const AffineVec& normal, double radius) {
  const double x = normal.x.center, y = normal.y.center, z = normal.z.center;
  const double off_axis = std::hypot(x, y), across = std::hypot(normal.x.radius(), normal.y.radius());
  const double away = std::hypot(across, normal.z.radius());
  if (!(across < 0.5 * off_axis) || !(away < 0.5)) return {};
  constexpr double pi = std::numbers::pi, slack = 0x1p-44;
  const Vec2 uv = spherical_uv({x, y, z});
  const double turn = std::asin(across / off_axis) / (2 * pi) + slack;
  const double tilt = std::asin(std::min(1.0, away / std::hypot(off_axis, z))) / pi + slack;
  if (uv.x - turn < 0 || uv.x + turn >= 1) return {};
  return {{uv.x - turn, uv.x + turn},
          {uv.y - tilt, uv.y + tilt},
          1 / (2 * pi * radius * (off_axis - across)),
          1 / (pi * radius)};
}

Interval widened(const Interval& range, double slack) { return {range.low - slack, range.high + slack}; }

Interval widened(const AffineForm& form) { return widened(form.range(), form.magnitude() * 0x1p-44); }

/// Texture coordinates of a triangle, from its barycentric coordinates.
PatchUv triangle_range(const CompiledScene& scene, const SurfacePatch& patch) {
  const TriangleGeometry& mesh = scene.geometry().mesh(patch.primitive.geometry);
  const UvGradients gradients = uv_gradients_at(scene, {patch.primitive, 0, patch.u.center, patch.v.center}, Surface{});
  PatchUv uv{widened(patch.u), widened(patch.v), length(gradients.u), length(gradients.v)};
  if (mesh.uvs.empty()) return uv;
  const auto& vertices = mesh.triangles[patch.primitive.primitive];
  const AffineForm weight_a = 1 - (patch.u + patch.v);
  const auto range = [&](std::size_t i) {
    return widened(weight_a * mesh.uvs[vertices[0]][i] + patch.u * mesh.uvs[vertices[1]][i] +
                   patch.v * mesh.uvs[vertices[2]][i]);
  };
  uv.u = range(0);
  uv.v = range(1);
  return uv;
}

/// Linear texture coordinates of planes and flat quadrics: value and gradients at the center of the patch.
PatchUv linear_range(const CompiledScene& scene, const SurfacePatch& patch) {
  const Hit hit{patch.primitive, 0, static_cast<double>(patch.part), 0};
  Surface surface;
  surface.point.position = center(patch.hit);
  surface.geometric_normal = normalize(patch.back ? -center(patch.face) : center(patch.face));
  surface.object = patch.object;
  const Vec2 uv = uv_at(scene, hit, surface);
  const UvGradients gradients = uv_gradients_at(scene, hit, surface);
  const AffineVec offset = patch.hit - surface.point.position;
  const auto range = [&](double at, const Vec3& gradient) {
    const double slack = (std::abs(at) + length(gradient) * magnitude(patch.hit)) * 0x1p-44;
    return widened((dot(offset, gradient) + at).range(), slack);
  };
  return {range(uv.x, gradients.u), range(uv.y, gradients.v), length(gradients.u), length(gradients.v)};
}

PatchUv uv_range(const CompiledScene& scene, const SurfacePatch& patch) {
  const GeometrySet& geometry = scene.geometry();
  const auto [number, i] = patch.primitive;
  const AffineVec outward = patch.back ? -patch.normal : patch.normal;
  switch (geometry.kind_of(number)) {
    case GeometryKind::spheres: {
      const Axes& axes = scene.objects.uv_axes[patch.object];
      return spherical_range({dot(outward, axes.e0), dot(outward, axes.e1), dot(outward, axes.n)},
                             geometry.spheres[number].radius[i]);
    }
    case GeometryKind::quadrics:
      if (!patch.flat) return {};
      break;
    case GeometryKind::triangles:
      return triangle_range(scene, patch);
    case GeometryKind::planes:
      break;
  }
  return linear_range(scene, patch);
}

ColorInterval mixed_range(const std::array<Color, 2>& colors, const Interval& t) {
  const auto mix = [&](double at) { return interval_of(colors[0] * (1 - at) + colors[1] * at); };
  return hull(mix(t.low), mix(t.high));
}

ColorInterval whole_range(const std::array<Color, 2>& colors) {
  return hull(interval_of(colors[0]), interval_of(colors[1]));
}

ColorInterval pattern_range(const CheckerTexture& checker, const Interval& u, const Interval& v, Texture::Wrap) {
  if (std::floor(u.low) != std::floor(u.high) || std::floor(v.low) != std::floor(v.high))
    return whole_range(checker.colors);
  return interval_of(checker.colors[is_even(std::floor(u.low)) == is_even(std::floor(v.low)) ? 0 : 1]);
}

/// The wrapped coordinate is monotone between integers, and clamped everywhere.
ColorInterval pattern_range(const GradientTexture& gradient, const Interval&, const Interval& v, Texture::Wrap wrap) {
  if (wrap != Texture::Wrap::clamp && std::floor(v.low) != std::floor(v.high)) return whole_range(gradient.colors);
  return mixed_range(gradient.colors, {wrapped(wrap, v.low), wrapped(wrap, v.high)});
}

ColorInterval pattern_range(const NoiseTexture& noise, const Interval&, const Interval&, Texture::Wrap) {
  return whole_range(noise.colors);
}

/// Range of the texels of the full image that a lookup may average. Without a footprint of more than a texel bilinear
/// interpolation reaches texels up to one and a half texels away; else the coarser of two levels has texels of less
/// than four footprints (odd sizes included).
ColorInterval texel_range(const ImageMap& map, const Interval& u, const Interval& v, const Vec2& covered,
                          const ColorInterval& whole) {
  const Image& image = map.levels().front();
  const double texels = std::max(covered.x * image.width, covered.y * image.height);
  const double reach = texels <= 1 ? 1.5 : 6 * texels + 1.5;
  const double left = std::floor(u.low * image.width - reach), right = std::floor(u.high * image.width + reach);
  const double low = std::floor(v.low * image.height - reach), high = std::floor(v.high * image.height + reach);
  constexpr double texels_max = 256;
  if (!(left >= 0 && right < image.width && low >= 0 && high < image.height)) return whole;
  if (!((right - left + 1) * (high - low + 1) <= texels_max)) return whole;
  constexpr double infinity = std::numeric_limits<double>::infinity();
  ColorInterval range{{{infinity, -infinity}, {infinity, -infinity}, {infinity, -infinity}}};
  for (auto y = static_cast<std::uint32_t>(low); y <= static_cast<std::uint32_t>(high); ++y)
    for (auto x = static_cast<std::uint32_t>(left); x <= static_cast<std::uint32_t>(right); ++x) {
      const float* const texel = image.pixel(x, image.height - 1 - y);
      for (std::size_t c = 0; c < 3; ++c) range[c] = hull(range[c], {texel[c], texel[c]});
    }
  return range;
}

/// Averages are rounded: by less than 2^-40 of the largest color.
ColorInterval with_rounding(ColorInterval range) {
  for (Interval& channel : range) {
    const double slack = channel.low == channel.high ? 0 : channel.high * 0x1p-40;
    channel = {std::max(0.0, channel.low - slack), channel.high + slack};
  }
  return range;
}

}  // namespace

ColorInterval texture_range(const Texture& texture, const ImageMap* image) {
  if (image == nullptr)
    return with_rounding(std::visit(
        [](const auto& pattern) -> ColorInterval {
          if constexpr (std::is_same_v<std::decay_t<decltype(pattern)>, ImageTexture>)
            return {};
          else
            return whole_range(pattern.colors);
        },
        texture.pattern));
  const std::vector<float>& texels = image->levels().front().rgb;
  ColorInterval range{};
  for (std::size_t c = 0; c < 3 && texels.size() >= 3; ++c) {
    range[c] = {texels[c], texels[c]};
    for (std::size_t i = c; i < texels.size(); i += 3) range[c] = hull(range[c], {texels[i], texels[i]});
  }
  return with_rounding(range);
}

ColorInterval color_range(const CompiledScene& scene, const std::vector<ColorInterval>& textures,
                          const ColorOrTexture& color, const SurfacePatch& patch, const RayBundle& rays, double width) {
  const auto* const id = std::get_if<TextureId>(&color);
  if (id == nullptr) return interval_of(std::get<Color>(color));
  const Texture& texture = scene.textures[id->index];
  const ColorInterval& whole = textures[id->index];
  const PatchUv uv = uv_range(scene, patch);
  if (!uv.bounded()) return whole;
  Vec2 covered{};
  if (texture.filter == Texture::Filter::mipmap) {
    // A footprint is at most as wide as the ray's width over the smallest cosine to the normal of the face.
    const Interval rate = dot(rays.direction, patch.face).range();
    const double squared_lengths =
        squared_length(rays.direction).range().high * squared_length(patch.face).range().high;
    const double cosine = std::max(rate.low, -rate.high) / std::sqrt(squared_lengths) * (1 - 0x1p-40);
    if (!(cosine > 0)) return whole;
    covered = {uv.gradient_u * width / cosine * std::abs(texture.scale.x) * (1 + 0x1p-40),
               uv.gradient_v * width / cosine * std::abs(texture.scale.y) * (1 + 0x1p-40)};
  }
  const auto coordinate = [](const Interval& range, double scale, double offset, double reach) {
    const double a = range.low * scale + offset, b = range.high * scale + offset;
    const double slack = 0.5 * reach + (std::abs(a) + std::abs(b) + std::abs(offset)) * 0x1p-50;
    return Interval{std::min(a, b) - slack, std::max(a, b) + slack};
  };
  const bool is_image = std::holds_alternative<ImageTexture>(texture.pattern);
  const Interval u = coordinate(uv.u, texture.scale.x, texture.offset.x, is_image ? 0 : covered.x);
  const Interval v = coordinate(uv.v, texture.scale.y, texture.offset.y, is_image ? 0 : covered.y);
  const double largest = std::max({std::abs(u.low), std::abs(u.high), std::abs(v.low), std::abs(v.high)});
  if (!(largest < 0x1p40)) return whole;
  if (const auto* checker = std::get_if<CheckerTexture>(&texture.pattern))
    return with_rounding(pattern_range(*checker, u, v, texture.wrap));
  if (const auto* gradient = std::get_if<GradientTexture>(&texture.pattern))
    return with_rounding(pattern_range(*gradient, u, v, texture.wrap));
  if (const auto* noise = std::get_if<NoiseTexture>(&texture.pattern))
    return with_rounding(pattern_range(*noise, u, v, texture.wrap));
  const ImageMap* const image = scene.images[id->index].get();
  return image != nullptr ? with_rounding(texel_range(*image, u, v, covered, whole)) : whole;
}

}  // namespace tracer
