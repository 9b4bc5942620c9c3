#pragma once
/// Evaluation of textures: colors, bump maps and normal maps.

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <numbers>

#include "tracer/scene.h"
#include "tracer/src/math/lanes.h"
#include "tracer/src/math/sampling.h"
#include "tracer/src/textures/image_map.h"

namespace tracer {

// ---- box filter ----------------------------------------------------------------------------------------------------
// Means of one-dimensional patterns over an interval, in closed form. Intervals are first reduced to the nearest
// integer, which is exact, so that neither huge coordinates nor tiny widths suffer from cancellation.

/// Largest |coordinate| or width that is evaluated: beyond 2^53 a double has no fraction.
inline constexpr double coordinate_reach = 0x1p100;

inline bool is_even(double whole) { return std::floor(whole * 0.5) * 2 == whole; }

/// Mean over [x - width/2, x + width/2] of the function that is 1 where floor is even and -1 where it is odd.
WHITTLE_INLINE double alternating_mean(double x, double width) {
  const double low = std::floor(x - width / 2);
  if (!(width > 0) || low == std::floor(x + width / 2)) return is_even(std::floor(x)) ? 1 : -1;
  const double whole = std::nearbyint(x);
  const double left = x - whole - width / 2, right = x - whole + width / 2;
  // Antiderivative of the pattern that is 1 on [0,1): the distance to the nearest even integer.
  const auto area = [](double t) { return std::abs(t - 2 * std::nearbyint(t / 2)); };
  const double mean = (area(right) - area(left)) / width;
  return is_even(whole) ? mean : -mean;
}

/// x mapped to [0,1]: x - floor(x), clamped, or mirrored at every integer.
inline double wrapped(Texture::Wrap wrap, double x) {
  switch (wrap) {
    case Texture::Wrap::repeat:
      return x - std::floor(x);
    case Texture::Wrap::clamp:
      return std::clamp(x, 0.0, 1.0);
    case Texture::Wrap::mirror:
      return std::abs(x - 2 * std::nearbyint(x / 2));
  }
  return x;
}

inline double repeat_mean(double left, double right, double width) {
  const auto area = [](double t) {
    const double whole = std::floor(t), part = t - whole;
    return whole == -1 ? t + t * t / 2 : whole / 2 + part * part / 2;  // on [-1,0) without cancellation
  };
  return (area(right) - area(left)) / width;
}

inline double mirror_mean(double left, double right, double width, bool even) {
  const auto area = [](double t) {
    const double turns = std::nearbyint(t / 2), rest = t - 2 * turns;
    return turns + std::copysign(rest * rest / 2, rest);
  };
  const double mean = (area(right) - area(left)) / width;
  return even ? mean : 1 - mean;
}

/// By symmetry, values near 1 are computed from the side of 0, without cancellation.
inline double clamp_mean(double x, double width) {
  if (x > 0.5) return 1 - clamp_mean(1 - x, width);
  const auto area = [](double t) { return t < 0 ? 0 : t < 1 ? t * t / 2 : t - 0.5; };
  return (area(x + width / 2) - area(x - width / 2)) / width;
}

/// Mean of wrapped(wrap, t) over [x - width/2, x + width/2].
inline double wrapped_mean(Texture::Wrap wrap, double x, double width) {
  const double left = x - width / 2, right = x + width / 2;
  // Linear between integers: the mean is the value at the center.
  if (!(width > 0) || std::floor(left) == std::floor(right)) return wrapped(wrap, x);
  const double whole = std::nearbyint(x), part = x - whole;
  switch (wrap) {
    case Texture::Wrap::repeat:
      return repeat_mean(part - width / 2, part + width / 2, width);
    case Texture::Wrap::clamp:
      return std::clamp(clamp_mean(x, width), 0.0, 1.0);
    case Texture::Wrap::mirror:
      return mirror_mean(part - width / 2, part + width / 2, width, is_even(whole));
  }
  return 0;
}

// ---- gradient noise ------------------------------------------------------------------------------------------------

/// Contribution of a lattice point: its gradient, one of eight unit directions chosen by a hash of the coordinates'
/// bits (so no coordinate is too large), times the offset (x, y).
inline double lattice_slope(double i, double j, double x, double y) {
  const auto bits = [](double whole) { return std::bit_cast<std::uint64_t>(whole + 0.0); };  // -0 is 0
  const double diagonal = std::numbers::sqrt2 / 2;
  switch (mix(bits(i) ^ mix(bits(j))) >> 61) {
    case 0:
      return x;
    case 1:
      return -x;
    case 2:
      return y;
    case 3:
      return -y;
    case 4:
      return (x + y) * diagonal;
    case 5:
      return (x - y) * diagonal;
    case 6:
      return (y - x) * diagonal;
    default:
      return (-x - y) * diagonal;
  }
}

/// Noise in [-1, 1], 0 at integer coordinates, with continuous second derivatives: gradients of the four surrounding
/// lattice points, blended by 6t^5 - 15t^4 + 10t^3 (Perlin 2002, "Improving Noise"). Scaled by sqrt(2), because unit
/// gradients reach sqrt(1/2) in two dimensions.
inline double gradient_noise(double x, double y) {
  const double i = std::floor(x), j = std::floor(y);
  const double u = x - i, v = y - j;
  const auto fade = [](double t) { return t * t * t * (t * (t * 6 - 15) + 10); };
  const double low = std::lerp(lattice_slope(i, j, u, v), lattice_slope(i + 1, j, u - 1, v), fade(u));
  const double high = std::lerp(lattice_slope(i, j + 1, u, v - 1), lattice_slope(i + 1, j + 1, u - 1, v - 1), fade(u));
  return std::numbers::sqrt2 * std::lerp(low, high, fade(v));
}

/// Means over an interval of the blending weight of a lattice point, and of its product with the coordinate from there.
struct LatticeMeans {
  double weight, offset;
};

/// Over [t - width/2, t + width/2]. The weight is 1 - fade(|t|) up to |t| = 1.
inline LatticeMeans lattice_means(double t, double width) {
  const auto weights = [](double x) {
    const double s = std::min(std::abs(x), 1.0), s4 = s * s * s * s;
    return std::copysign(s + s4 * (-2.5 + s * (3 - s)), x);
  };
  const auto offsets = [](double x) {
    const double s = std::min(std::abs(x), 1.0), s2 = s * s;
    return s2 / 2 + s2 * s2 * s * (-2 + s * (2.5 - s * (6.0 / 7)));
  };
  const double low = t - width / 2, high = t + width / 2;
  return {(weights(high) - weights(low)) / width, (offsets(high) - offsets(low)) / width};
}

/// Mean of gradient_noise over the rectangle `width` around (x, y). The noise is a sum over lattice points of products
/// of polynomials in x and in y.
inline double gradient_noise_mean(double x, double y, const Vec2& width) {
  // The mean over a narrower interval is the value at its center: both terms are rounded by about 2^-34.
  constexpr double narrow = 0x1p-18;
  if (!(std::max(width.x, width.y) > narrow)) return gradient_noise(x, y);
  const double i = std::floor(x), j = std::floor(y), u = x - i, v = y - j;
  const double across = std::max(width.x, narrow), along = std::max(width.y, narrow);
  double sum = 0;
  for (double row = std::floor(v - along / 2); row <= std::floor(v + along / 2) + 1; ++row) {
    const LatticeMeans in_v = lattice_means(v - row, along);
    for (double column = std::floor(u - across / 2); column <= std::floor(u + across / 2) + 1; ++column) {
      const LatticeMeans in_u = lattice_means(u - column, across);
      sum += lattice_slope(i + column, j + row, in_u.offset * in_v.weight, in_u.weight * in_v.offset);
    }
  }
  return std::numbers::sqrt2 * sum;
}

/// Mean over the rectangle `width` of the sum of `octaves`, divided by the root of the sum of their squared amplitudes
/// and clamped to [-1, 1]. An octave with many cells in the rectangle has a mean near 0: it fades out from 32 to 64
/// lattice points, which bounds the work.
inline double octave_noise(double x, double y, std::uint32_t octaves, Vec2 width) {
  double sum = 0, squares = 0, amplitude = 1;
  for (std::uint32_t octave = 0; octave < octaves; ++octave, amplitude /= 2, x *= 2, y *= 2) {
    squares += amplitude * amplitude;
    const double points = (width.x + 2) * (width.y + 2), left = std::clamp(2 - points / 32, 0.0, 1.0);
    if (left > 0) sum += amplitude * left * gradient_noise_mean(x, y, width);
    width = {2 * width.x, 2 * width.y};
  }
  return std::clamp(sum / std::sqrt(squares), -1.0, 1.0);
}

// ---- textures ------------------------------------------------------------------------------------------------------

/// Mean of the pattern over the rectangle `width` around (u, v), or its value at the point for zero width. floor works
/// on doubles, so no coordinate overflows.
inline Color pattern_color(const CheckerTexture& checker, const Vec2& uv, const Vec2& width, Texture::Wrap) {
  // The sign is separable in u and v, and so is its mean over a rectangle.
  const double sign = alternating_mean(uv.x, width.x) * alternating_mean(uv.y, width.y);
  if (std::abs(sign) == 1) return checker.colors[sign > 0 ? 0 : 1];
  return checker.colors[0] * ((1 + sign) / 2) + checker.colors[1] * ((1 - sign) / 2);
}

inline Color pattern_color(const GradientTexture& gradient, const Vec2& uv, const Vec2& width, Texture::Wrap wrap) {
  const double t = wrapped_mean(wrap, uv.y, width.y);
  return gradient.colors[0] * (1 - t) + gradient.colors[1] * t;
}

inline Color pattern_color(const NoiseTexture& noise, const Vec2& uv, const Vec2& width, Texture::Wrap) {
  const double t = 0.5 + 0.5 * octave_noise(uv.x, uv.y, noise.octaves, width);
  return noise.colors[0] * (1 - t) + noise.colors[1] * t;
}

/// A point in texture coordinates and the footprint around it; zero width without filtering.
struct Lookup {
  Vec2 at, covered;
};

/// The lookup for the surface coordinates `uv` and `width` of them.
inline Lookup lookup(const Texture& texture, const Vec2& uv, const Vec2& width) {
  const auto near = [](double x) { return std::clamp(x, -coordinate_reach, coordinate_reach); };
  const Vec2 at{near(uv.x * texture.scale.x + texture.offset.x), near(uv.y * texture.scale.y + texture.offset.y)};
  if (texture.filter != Texture::Filter::mipmap) return {at, {}};
  return {at, {near(width.x * std::abs(texture.scale.x)), near(width.y * std::abs(texture.scale.y))}};
}

/// Mean over the footprint, before the factor; see texture_color().
inline Color unscaled_color(const Texture& texture, const Lookup& place, const ImageMap* image, const Wraps& wraps) {
  const auto& [at, covered] = place;
  if (image != nullptr) {
    if (texture.filter == Texture::Filter::mipmap) return image->trilinear(at, covered, wraps);
    return texture.filter == Texture::Filter::bilinear ? image->bilinear(at, wraps) : image->nearest(at, wraps);
  }
  if (const auto* checker = std::get_if<CheckerTexture>(&texture.pattern))
    return pattern_color(*checker, at, covered, wraps.v);
  if (const auto* gradient = std::get_if<GradientTexture>(&texture.pattern))
    return pattern_color(*gradient, at, covered, wraps.v);
  return pattern_color(std::get<NoiseTexture>(texture.pattern), at, covered, wraps.v);
}

/// Mean over the footprint. `image` is the image of an ImageTexture, null for patterns; `wraps` overrides the texture's
/// wrap mode.
inline Color texture_color(const Texture& texture, const Lookup& place, const ImageMap* image, const Wraps& wraps) {
  return unscaled_color(texture, place, image, wraps) * texture.factor;
}

/// Color of `texture` at the surface coordinates `uv`, filtered over the footprint `width` if its filter is mipmap.
inline Color texture_color(const Texture& texture, const Vec2& uv, const Vec2& width = {},
                           const ImageMap* image = nullptr) {
  return texture_color(texture, lookup(texture, uv, width), image, {texture.wrap, texture.wrap});
}

/// Upper bound of the channels of any lookup: filtering only averages.
inline double texture_bound(const Texture& texture, const ImageMap* image) {
  const double factor = max_component(texture.factor);
  if (image != nullptr) {
    const std::vector<float>& texels = image->levels().front().rgb;
    return texels.empty() ? 0 : factor * *std::max_element(texels.begin(), texels.end());
  }
  const auto& colors = std::visit(
      [](const auto& pattern) -> std::array<Color, 2> {
        if constexpr (std::is_same_v<std::decay_t<decltype(pattern)>, ImageTexture>)
          return {};
        else
          return pattern.colors;
      },
      texture.pattern);
  return factor * std::max(max_component(colors[0]), max_component(colors[1]));
}

/// Minimum step of the finite difference: below it there is only interpolation, whose slope is discontinuous. For an
/// image, a texel of the mip level in use.
inline Vec2 finest_step(const Texture& texture, const Vec2& covered, const ImageMap* image) {
  if (image != nullptr) {
    const Image& level = image->levels().front();
    const double texels = std::max({covered.x * level.width, covered.y * level.height, 1.0});
    return {texels / level.width, texels / level.height};
  }
  const auto* noise = std::get_if<NoiseTexture>(&texture.pattern);
  const double cell = noise != nullptr ? std::ldexp(1.0, 1 - static_cast<int>(noise->octaves)) : 1;
  return {cell * 0x1p-10, cell * 0x1p-10};
}

/// Derivatives of the height along u and v of the surface, as finite differences over the footprint; without a
/// footprint over the finest detail of the texture: one texel of an image, a thousandth of a pattern's smallest cell.
inline Vec2 height_slope(const Texture& texture, const Vec2& uv, const Vec2& width, const ImageMap* image) {
  const Lookup here = lookup(texture, uv, width);
  const Vec2 least = finest_step(texture, here.covered, image);
  const auto height = [&](const Vec2& at) {
    const Color color = texture_color(texture, Lookup{at, here.covered}, image, {texture.wrap, texture.wrap});
    return (color.r + color.g + color.b) / 3;
  };
  // Divided by the step after rounding, which is 0 beyond 2^53, where coordinates have no fraction.
  const auto slope = [&](const Vec2& low, const Vec2& high, double step) {
    return step > 0 ? (height(high) - height(low)) / step : 0;
  };
  const double half_u = std::max(here.covered.x, least.x) / 2, half_v = std::max(here.covered.y, least.y) / 2;
  const Vec2 left{here.at.x - half_u, here.at.y}, right{here.at.x + half_u, here.at.y};
  const Vec2 low{here.at.x, here.at.y - half_v}, high{here.at.x, here.at.y + half_v};
  return {slope(left, right, right.x - left.x) * texture.scale.x, slope(low, high, high.y - low.y) * texture.scale.y};
}

/// Normal encoded in a color, in the frame (dp/du, dp/dv, n), with n.x and n.y times `scale`. Not unit length; zero if
/// the color encodes no direction.
inline Vec3 tangent_normal(const Color& color, double scale = 1) {
  return {(2 * color.r - 1) * scale, (2 * color.g - 1) * scale, 2 * color.b - 1};
}

}  // namespace tracer
