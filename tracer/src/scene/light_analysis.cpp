// The light of a scene: the sentence about light between its surfaces, and warnings of light that it lacks.
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <set>
#include <string>
#include <utility>

#include "tracer/requirements.h"
#include "tracer/src/lights/light_registry.h"
#include "tracer/src/materials/compiled_material.h"
#include "tracer/src/scene/checks.h"
#include "tracer/src/scene/color_bound.h"
#include "tracer/src/scene/enclosure.h"
#include "tracer/src/scene/instancing.h"
#include "tracer/src/scene/render_space.h"

namespace tracer {
namespace {

/// Light that the surfaces in use emit and give back.
struct SurfaceLight {
  /// Diffuse colors; the second number is a texture's index plus one, or 0.
  std::set<std::pair<std::array<double, 3>, std::uint32_t>> colors;
  double diffuse = 0;                       ///< largest share that one of them reflects or transmits diffusely
  double returned = 0;                      ///< largest share that one of them gives back in any way
  std::optional<std::string> emitter;       /// pointer of the first material that glows
  std::optional<std::string> excess;        ///< a material that gives back more than it receives
  std::optional<std::string> white_excess;  ///< one that does so with a white image file
};

void add(const Scene& scene, const Material& material, SurfaceLight& found) {
  const auto bound_of = [&](const ColorOrTexture& color) { return bound_before_reading(scene, color, 1); };
  const auto certain_bound_of = [&](const ColorOrTexture& color) { return bound_before_reading(scene, color, 0); };
  if (!found.emitter && max_component(bound_of(material.emission)) > 0) found.emitter = material.path;
  if (const auto excess = excess_of_light(material, certain_bound_of); excess && !found.excess)
    found.excess = material.path + " " + *excess;
  if (excess_of_light(material, bound_of) && !found.white_excess) found.white_excess = material.path;
  const Coefficients most = coefficient_bounds(material, {}, bound_of);
  const Color diffuse = most.scattered();
  if (!(max_component(diffuse) > 0)) return;
  const auto* texture = std::get_if<TextureId>(&material.color);
  found.colors.insert({{diffuse.r, diffuse.g, diffuse.b}, texture == nullptr ? 0 : texture->index + 1});
  found.diffuse = std::max(found.diffuse, max_component(diffuse));
  found.returned = std::max(found.returned, max_component(returned_share(material, bound_of)));
}

/// Half of the first step of an 8-bit code, in linear light (IEC 61966-2-1).
constexpr double half_code = 0.5 / 255 / 12.92;

double distance(const Bounds& box, const Vec3& p) {
  const Vec3 low = box.low - p, high = p - box.high;
  return std::hypot(std::max({low.x, high.x, 0.0}), std::max({low.y, high.y, 0.0}), std::max({low.z, high.z, 0.0}));
}

/// Lower bound of the distance between a point and an object; 0 for a mesh that is not read yet.
double distance(const Placed& placed, const Bounds& box, const Vec3& p) {
  const auto* plane = std::get_if<Plane>(&placed.shape);
  if (plane == nullptr) return box.empty() ? 0 : distance(box, p);
  const Affine& map = placed.world_from_object;
  return std::abs(dot(p - map.point(plane->point), normalize(transformed_normal(map.linear, plane->normal))));
}

class LightWarningFinder {
 public:
  explicit LightWarningFinder(const Scene& scene) : scene_(scene) {
    has_light_ = scene.accuracy.has_ambient_term(scene.accuracy.approximate) && !is_black(scene.ambient);
    for (std::size_t i = 0; i < scene.lights.size(); ++i) {
      const double power = scene.lights[i].intensity * max_component(scene.lights[i].color) * exposure_;
      has_light_ = has_light_ || power > 0;
      if (const auto sphere = extent(scene.lights[i].source); sphere && power > 0 && i < compared_lights_max)
        lamps_.push_back({i, sphere->first, sphere->second, power});
    }
  }

  std::vector<Issue> find() {
    for (const Material& material : scene_.materials) check(material);
    for_each_placed(scene_, [&](const Placed& placed) { check(placed); });
    check_faint_lights();
    const bool is_global = scene_.accuracy.model == Accuracy::Model::global;
    if (!is_global && receivers_ > 0 && !first_lamp_.empty())
      found_.push_back({first_lamp_, "emission_lights_nothing",
                        "brightens this surface alone: add a light at its place, or set /accuracy/model to global, "
                        "where emission lights other surfaces"});
    if (is_global && glossy_ * glowing_ > both_)
      found_.push_back({first_glossy_, "highlight_omitted",
                        "highlights are those of \"lights\" alone: where /accuracy/model is global, objects with "
                        "emission have none on this surface; \"reflection\" shows them"});
    return std::move(found_);
  }

 private:
  struct Lamp {
    std::size_t index;
    Vec3 center;
    double radius;
    double power;       ///< displayed value of a white surface without attenuation
    double brings = 0;  ///< upper bound of the displayed value at the objects until here; not raised above half a code
  };
  /// Upper bounds, by channel maximum.
  struct Surface {
    double gain;     ///< response to lights
    double glow;     ///< displayed value of its emission
    bool is_glossy;  ///< has highlights
  };

  void check(const Material& material) {
    const auto bound_of = [&](double image) {
      return
          [&scene = scene_, image](const ColorOrTexture& color) { return bound_before_reading(scene, color, image); };
    };
    const Coefficients most = coefficient_bounds(material, {}, bound_of(1));
    const Color highlight = most.highlights();
    surfaces_.push_back({max_component(most.scattered() + highlight), max_component(most.emitted_ambient) * exposure_,
                         !is_black(highlight)});
    if (!(material.transmission > 0 && material.diffuse == Material().diffuse)) return;
    if (const auto excess = excess_of_light(material, bound_of(0)))
      found_.push_back({material.path + "/diffuse", "energy_gain",
                        *excess + ", and looks milky; clear glass has a black \"color\" or \"diffuse\": 0"});
  }

  void check(const Placed& placed) {
    const Material& material = scene_.materials[placed.material.index];
    const auto& [gain, glow, is_glossy] = surfaces_[placed.material.index];
    const bool glows = glow > 0;
    const Bounds box = bounds_of(placed);
    receivers_ += gain > 0 && !glows ? 1 : 0;
    glowing_ += glows ? 1 : 0;
    both_ += glows && is_glossy ? 1 : 0;
    if (is_glossy && glossy_++ == 0)
      first_glossy_ = material.path + (has_specular(material) ? "/specular" : "/specular_transmission");
    // Values up to 1 may be those of a sign or a screen.
    if (glows && first_lamp_.empty() && (!has_light_ || (glow > 1 && !is_lit_at(box))))
      first_lamp_ = material.path + "/emission";
    for (Lamp& lamp : lamps_) {
      const auto& [kind, c] = scene_.lights[lamp.index].attenuation;
      if (kind == Attenuation::Kind::none || lamp.brings >= half_code || !(gain > 0)) continue;
      const double d = std::max(distance(placed, box, lamp.center) - lamp.radius, 0.0);
      const bool is_square = kind == Attenuation::Kind::inverse_square;
      const double factor = is_square ? inverse_square_attenuation(d) : polynomial_attenuation(c, d);
      lamp.brings = std::max(lamp.brings, lamp.power * gain * factor);
    }
  }

  /// True if a light is next to the box, within its diagonal. A directional light may stand for any object.
  [[nodiscard]] bool is_lit_at(const Bounds& box) const {
    if (lamps_.size() < scene_.lights.size() || box.empty()) return !scene_.lights.empty();
    return std::ranges::any_of(lamps_, [&](const Lamp& lamp) {
      return distance(box, lamp.center) - lamp.radius <= length(box.high - box.low);
    });
  }

  /// Many faint lights may be bright together.
  void check_faint_lights() {
    std::erase_if(lamps_, [](const Lamp& lamp) { return !(lamp.brings > 0 && lamp.brings < half_code); });
    double sum = 0;
    for (const Lamp& lamp : lamps_) sum += lamp.brings;
    if (scene_.lights.size() > compared_lights_max || sum >= half_code) return;
    for (const Lamp& lamp : lamps_) {
      const double wanted = std::round(std::log10(scene_.lights[lamp.index].intensity / lamp.brings));
      found_.push_back({"/lights/" + std::to_string(lamp.index) + "/intensity", "light_too_faint",
                        "is black at every surface: \"attenuation\" divides it over the distance; an intensity near " +
                            text_of(std::pow(10, wanted)) + " would be bright"});
    }
  }

  const Scene& scene_;
  const double exposure_ = std::exp2(scene_.output.exposure);
  bool has_light_;                 ///< from `lights` or `ambient`
  std::vector<Surface> surfaces_;  ///< by material
  std::vector<Lamp> lamps_;
  std::vector<Issue> found_;
  std::size_t receivers_ = 0, glowing_ = 0, glossy_ = 0, both_ = 0;  ///< objects
  std::string first_glossy_, first_lamp_;
};

}  // namespace

std::string global_light_summary(const Scene& scene) {
  SurfaceLight found;
  for_each_placed(scene, [&](const Placed& placed) { add(scene, scene.materials[placed.material.index], found); });
  if (found.excess) return "not possible: " + *found.excess;
  if (found.colors.empty()) return "adds nothing: no surface reflects light diffusely";
  std::string sentence = "adds light between surfaces of " + std::to_string(found.colors.size()) + " diffuse color" +
                         (found.colors.size() == 1 ? "" : "s") + " that reflect up to " + text_of(found.diffuse, 2);
  const Enclosure enclosure = enclosure_of_camera(scene);
  if (enclosure != Enclosure::none)
    sentence += enclosure == Enclosure::closed ? " in a closed room" : " in a room with an open side";
  sentence += ", ";
  // A mirror or glass without a diffuse part passes on light of other surfaces, which is counted there.
  sentence += found.returned < 1 ? "at most " + text_of(found.diffuse / (1 - found.returned), 2) +
                                       " times the brightest light without it"
                                 : "without an upper bound";
  if (found.emitter) sentence += "; glowing surfaces light others (" + *found.emitter + ")";
  const Background& background = scene.background;
  if (max_component(background.color) > 0 || background.gradient || background.environment || background.cube)
    sentence += "; the background lights surfaces";
  if (found.white_excess)
    sentence += "; not possible if an image file is white: " + *found.white_excess +
                " then gives back more light than it receives";
  return sentence;
}

std::optional<std::pair<Vec3, double>> extent(const LightSource& source) {
  using Extent = std::pair<Vec3, double>;
  if (const auto* point = std::get_if<PointLight>(&source)) return Extent{point->position, 0};
  if (const auto* spot = std::get_if<SpotLight>(&source)) return Extent{spot->position, 0};
  if (const auto* disc = std::get_if<DiscLight>(&source)) return Extent{disc->center, disc->radius};
  if (const auto* sphere = std::get_if<SphereLight>(&source)) return Extent{sphere->center, sphere->radius};
  if (const auto* line = std::get_if<LineLight>(&source))
    return Extent{(line->from + line->to) / 2, length(line->to - line->from) / 2};
  if (const auto* rect = std::get_if<RectLight>(&source))
    return Extent{rect->corner + (rect->edge_u + rect->edge_v) / 2, (length(rect->edge_u) + length(rect->edge_v)) / 2};
  return std::nullopt;
}

std::vector<Issue> light_warnings(const Scene& scene) { return LightWarningFinder(scene).find(); }

}  // namespace tracer
