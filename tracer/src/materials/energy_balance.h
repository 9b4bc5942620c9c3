#pragma once
/// Light that a surface gives back. Under the rendering equation it must not exceed what it receives: light between
/// such surfaces would grow without end.

#include <array>
#include <cstdio>
#include <optional>
#include <string>
#include <utility>

#include "tracer/src/materials/compiled_material.h"

namespace tracer {

/// Upper bound, by channel, of the share of the arriving light that the surface sends on, highlights of lights left
/// out. `bound_of` returns an upper bound of a ColorOrTexture.
template <class BoundOf>
Color returned_share(const Material& material, const BoundOf& bound_of) {
  const Coefficients most = coefficients(material, {}, bound_of);
  const Color &reflected = most.reflectance, &transmitted = most.transmittance;
  // Fresnel's reflectance and transmittance add up to one.
  const Color diffuse = most.diffuse + most.diffuse_transmission;
  if (!material.fresnel) return diffuse + reflected + transmitted;
  return diffuse + Color{std::max(reflected.r, transmitted.r), std::max(reflected.g, transmitted.g),
                         std::max(reflected.b, transmitted.b)};
}

/// The sentence for a surface that gives back more light than it receives; none if it does not.
template <class BoundOf>
std::optional<std::string> excess_of_light(const Material& material, const BoundOf& bound_of) {
  constexpr double rounding = 0x1p-40;
  const Color share = returned_share(material, bound_of);
  const double most = max_component(share);
  if (!(most > 1 + rounding)) return std::nullopt;
  const auto text = [](double value) {
    std::array<char, 32> buffer{};
    std::snprintf(buffer.data(), buffer.size(), "%.4g", value);
    return std::string(buffer.data());
  };
  std::string parts;
  for (const auto& [name, factor] :
       {std::pair{"diffuse ", material.diffuse * opaque_share(material)},
        std::pair{"diffuse_transmission ", material.diffuse_transmission},
        std::pair{"reflection ", material.reflection}, std::pair{"transmission ", material.transmission}})
    if (factor > 0) parts += (parts.empty() ? "" : " + ") + (name + text(factor));
  const char* const channel = most == share.r ? "red" : most == share.g ? "green" : "blue";
  return "gives back " + text(most) + " of the light that it receives (" + parts + ", " + channel +
         "): must be <= 1 where /accuracy/model is global";
}

}  // namespace tracer
