#include "tracer/warnings.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>

#include "tracer/src/materials/compiled_material.h"
#include "tracer/src/scene/checks.h"
#include "tracer/src/scene/instancing.h"
#include "tracer/src/scene/render_space.h"
#include "tracer/src/shapes/shape_registry.h"

namespace tracer {
namespace {

/// The directions or lines that camera rays may take, as a cone or a cylinder around the image; all for a panorama or a
/// stereo pair.
class View {
 public:
  explicit View(const Scene& scene) : camera_(scene.camera), axis_(normalize(camera_.look_at - camera_.position)) {
    const double proportions = static_cast<double>(scene.image.width) / scene.image.height;
    const double diagonal = std::hypot(proportions, 1.0);
    angle_ = std::atan(std::tan(camera_.fov_deg * (std::numbers::pi / 360)) * diagonal);
    radius_ = camera_.height / 2 * diagonal;
  }

  /// True if the box is completely behind the camera.
  [[nodiscard]] bool is_behind(const Bounds& box) const {
    const Vec3 half = (box.high - box.low) / 2;
    return camera_.type != Camera::Type::panorama &&
           dot(box.low + half - camera_.position, axis_) + dot(abs(axis_), half) < 0;
  }

  /// False if no camera ray meets the sphere around the box.
  [[nodiscard]] bool may_hit(const Bounds& box) const {
    if (camera_.type == Camera::Type::panorama || camera_.layout != Camera::Layout::single) return true;
    const Vec3 half = (box.high - box.low) / 2, to = box.low + half - camera_.position;
    const double radius = length(half) + camera_.aperture, distance = length(to), depth = dot(to, axis_);
    if (camera_.type == Camera::Type::orthographic)
      return depth + radius > 0 && length(to - axis_ * depth) <= radius_ + radius;
    return distance <= radius ||
           std::acos(std::clamp(depth / distance, -1.0, 1.0)) - std::asin(radius / distance) <= angle_;
  }

  /// False if the plane is on the side of the camera to which no ray goes.
  [[nodiscard]] bool may_hit(const Vec3& point, const Vec3& normal) const {
    if (camera_.type != Camera::Type::perspective || camera_.layout != Camera::Layout::single) return true;
    const Vec3 n = normalize(dot(camera_.position - point, normal) < 0 ? -normal : normal);
    return std::acos(std::clamp(dot(axis_, n), -1.0, 1.0)) + angle_ > std::numbers::pi / 2;
  }

 private:
  const Camera& camera_;
  Vec3 axis_;
  double angle_, radius_;
};

/// Distance from the surface to a point in a closed standard shape, in the shape's space; not positive for a point
/// outside, nor for any if there is no inside.
double depth(const StandardImage<UnitSphere>& /*image*/, const Vec3& p) { return 1 - length(p); }
double depth(const StandardImage<UnitCube>& /*image*/, const Vec3& p) {
  return 0.5 - max_component(abs(p - Vec3{0.5, 0.5, 0.5}));
}
double depth(const StandardImage<UnitDisc>& /*image*/, const Vec3& /*p*/) { return -1; }
double depth(const StandardImage<UnitTorus>& image, const Vec3& p) {
  return image.radius_0 - std::hypot(std::hypot(p.x, p.y) - 1, p.z);
}
double depth(const StandardImage<Frustum>& image, const Vec3& p) {
  const double slope = image.radius_1 - image.radius_0;
  const double side = (image.radius_0 + slope * p.z - std::hypot(p.x, p.y)) / std::hypot(1, slope);
  return image.caps ? std::min({p.z, 1 - p.z, side}) : -1;
}

/// True if a line through the point crosses a mesh an odd number of times at both ends: it is closed around the point.
bool is_around(const Mesh& mesh, const Affine& world_from_object, const Vec3& point) {
  constexpr Vec3 directions[] = {{0.37, 1, 0.21}, {0.21, 0.37, 1}, {1, 0.21, 0.37}};  // along no usual edge
  return std::ranges::all_of(directions, [&](const Vec3& d) {
    std::array<bool, 2> is_odd{};
    for (const auto& triangle : mesh.triangles) {
      std::array<Vec3, 3> at{};
      for (std::size_t i = 0; i < 3; ++i) at[i] = world_from_object.point(mesh.positions[triangle[i]]) - point;
      const auto& [a, b, c] = at;
      const bool ab = dot(d, cross(a, b)) > 0, bc = dot(d, cross(b, c)) > 0, ca = dot(d, cross(c, a)) > 0;
      const bool is_front = dot(a, cross(b, c)) > 0;
      if (ab == bc && bc == ca) is_odd[ab == is_front ? 1 : 0] ^= true;
    }
    return is_odd[0] && is_odd[1];
  });
}

bool is_in(const Bounds& box, const Vec3& p) {
  return p.x >= box.low.x && p.x <= box.high.x && p.y >= box.low.y && p.y <= box.high.y && p.z >= box.low.z &&
         p.z <= box.high.z;
}

/// Places that a ray hits: a surface that splits it, one that only reflects it, or from inside the one around it.
enum Place : std::size_t { glass, mirror, inside, places };

/// A surface that reflects, as a sphere of about its size or as a plane, whose normal is not 0.
struct Reflector {
  Place place;
  Vec3 center, normal;
  double radius, itself;  ///< probability that a ray that leaves it hits it again

  /// Probability that a ray that leaves this surface hits `to`. The constants are fitted to traced rays.
  [[nodiscard]] double hit_probability(const Reflector& to) const {
    if (this == &to) return itself;
    if (!(to.normal == Vec3{})) return dot(normal, to.normal) < -0.999 ? 1 : 0.4;
    const double distance = radius > 0 ? length(to.center - center) : std::abs(dot(to.center - center, normal));
    if (to.place == mirror && radius > 0 && distance + radius <= to.radius) return 1;
    const double sine = to.radius > 0 ? to.radius / std::max(to.radius, distance - radius / 2) : 0;
    return 0.28 * sine * sine;
  }
};

Reflector reflector_of(const Placed& placed, Place place, const Vec3& camera) {
  if (const auto* plane = std::get_if<Plane>(&placed.shape))
    return {place, placed.world_from_object.point(plane->point),
            normalize(transformed_normal(placed.world_from_object.linear, plane->normal)), 0, 0};
  const Bounds box = bounds_of(placed);
  if (box.empty()) return {place, {}, {}, 0, 0};
  const bool is_convex = !std::holds_alternative<Mesh>(placed.shape) && !std::holds_alternative<Torus>(placed.shape);
  const double itself = place == mirror && is_in(box, camera) ? 1 : is_convex ? 0 : 0.1;
  return {place, (box.low + box.high) / 2, {}, length(box.high - box.low) / std::sqrt(12.0), itself};
}

class WarningFinder {
 public:
  explicit WarningFinder(const Scene& scene) : scene_(scene), view_(scene) {
    for (std::size_t i = 0; i < std::min(scene.lights.size(), compared_lights_max); ++i)
      if (const auto light = extent(scene.lights[i].source); light && scene.lights[i].shadows)
        lights_.emplace_back(i, *light);
  }

  std::vector<Issue> find() {
    check_camera();
    for (std::size_t i = 0; i < scene_.lights.size(); ++i) check(scene_.lights[i], "/lights/" + std::to_string(i));
    check_radiance("/ambient", scene_.ambient);
    if (!has_ambient_ && !is_black(scene_.ambient))
      add("/ambient", "no_effect",
          "is left out where /accuracy/model is global, unless /accuracy/approximate/interreflection is \"ambient\"");
    check_radiance("/background/color", scene_.background.color);
    for (const Material& material : scene_.materials) check(material);
    for_each_placed(scene_, [&](const Placed& placed) { check(placed); });
    check_around_camera();
    for (const Issue& issue : light_warnings(scene_)) add(issue.pointer, issue.code, issue.detail);
    check_totals();
    if (const double rays = predicted_rays(scene_); rays > 1000)
      add("/accuracy/max_depth", "many_secondary_rays",
          "a sample may take " + text_of(std::round(rays)) +
              " rays at glass and mirrors: set or lower max_depth, or raise cutoff");
    return std::move(found_);
  }

 private:
  void add(const std::string& pointer, const std::string& code, const std::string& detail) {
    if (found_.size() < warnings_max) found_.push_back({pointer, code, detail});
  }

  void check_camera() {
    const double fov = scene_.camera.fov_deg;
    if (scene_.camera.type == Camera::Type::perspective && fov <= std::numbers::pi)
      add("/camera/fov", "radians", "angles are in degrees, got " + text_of(fov) + ": is it in radians?");
  }

  void check(const Light& light, const std::string& path) {
    if (light.attenuation.kind != Attenuation::Kind::inverse_square) check_radiance(path + "/color", light.color);
    is_lit_ = is_lit_ || (light.intensity > 0 && !is_black(light.color));
    if (const auto* spot = std::get_if<SpotLight>(&light.source);
        spot != nullptr && spot->outer_angle_deg > 0 && spot->outer_angle_deg <= std::numbers::pi / 2)
      add(path + "/outer_angle", "radians",
          "angles are in degrees, got " + text_of(spot->outer_angle_deg) + ": is it in radians?");
  }

  /// Radiance may be above 1; only a color of bytes is probably an error.
  void check_radiance(const std::string& path, const Color& color) {
    const double most = max_component(color);
    const auto is_byte = [](double c) { return c == std::trunc(c) && c <= 255; };
    if (most > 50 && is_byte(color.r) && is_byte(color.g) && is_byte(color.b)) add_color(path, most);
  }

  void add_color(const std::string& path, double most) {
    add(path, "color_above_1",
        "1 is full intensity, got " + text_of(most) + ": colours are linear from 0 to 1, or \"#rrggbb\"");
  }

  void check(const Material& material) {
    if (const auto* color = std::get_if<Color>(&material.color)) {
      if (max_component(*color) > 1) add_color(material.path + "/color", max_component(*color));
    } else if (const Texture& texture = scene_.textures[std::get<TextureId>(material.color).index];
               !std::holds_alternative<ImageTexture>(texture.pattern)) {
      std::visit(
          [&](const auto& pattern) {
            if constexpr (requires { pattern.colors; })
              if (const double most = std::max(max_component(pattern.colors[0]), max_component(pattern.colors[1]));
                  most > 1)
                add_color(texture.path, most);
          },
          texture.pattern);
    }
    if (const auto* emission = std::get_if<Color>(&material.emission))
      check_radiance(material.path + "/emission", *emission);
  }

  void check(const Placed& placed) {
    const Material& material = scene_.materials[placed.material.index];
    const auto* emission = std::get_if<Color>(&material.emission);
    is_lit_ = is_lit_ || emission == nullptr || !is_black(*emission);
    reflects_ = reflects_ || is_principled(material) || material.reflection > 0 || material.transmission > 0 ||
                (has_interreflection_ && material.diffuse > 0);
    any_object_ = true;
    if (const auto* plane = std::get_if<Plane>(&placed.shape)) {
      const Affine& map = placed.world_from_object;
      in_view_ = in_view_ || view_.may_hit(map.point(plane->point), transformed_normal(map.linear, plane->normal));
      return;
    }
    const Bounds box = bounds_of(placed);
    check_resolution(placed, box);
    if (!box.empty() && view_.is_behind(box)) {
      if (placed.shadow && behind_++ == 0) first_behind_ = pointer(placed);
    } else if (!in_view_) {
      in_view_ = box.empty() || view_.may_hit(box);
    }
    if (!lets_light_pass(material) && ((placed.shadow && has_light(box)) || is_in(box, scene_.camera.position)))
      std::visit([&](const auto& shape) { check_inside(shape, placed, box); }, placed.shape);
  }

  /// Coordinates are doubles: 53 binary digits, of which a shape needs some to have a form.
  void check_resolution(const Placed& placed, const Bounds& box) {
    constexpr double digits = 0x1p-40;
    if (box.empty()) return;
    const double largest = std::max(
        {largest_component(box.low), largest_component(box.high), largest_component(box.low - scene_.camera.position)});
    const double size = length(box.high - box.low);
    if (!(size > 0 && size < largest * digits) || too_small_++ > 0) return;
    first_too_small_ = pointer(placed);
    too_small_detail_ = "spans " + text_of(size) + ", but coordinates and distances of " + text_of(largest) +
                        " are rounded to " + text_of(largest * 0x1p-53) + ": move it to the origin and the camera";
  }

  /// True if one of the lights that are compared with solids may be in one with this box.
  [[nodiscard]] bool has_light(const Bounds& box) const {
    return std::ranges::any_of(lights_, [&](const auto& light) { return is_in(box, light.second.first); });
  }

  /// The camera, or else lights, in a closed opaque solid.
  template <class S>
  void check_inside(const S& shape, const Placed& placed, const Bounds& box) {
    if constexpr (std::is_same_v<S, Mesh>) {
      if (is_in(box, scene_.camera.position) && is_around(shape, placed.world_from_object, scene_.camera.position))
        add_around_camera(placed, box);
    } else if constexpr (Analytic<S>) {
      const auto image = standard_image(shape);
      const Affine map = placed.world_from_object * image.object_from_standard;
      const Linear inverse_map = inverse(map.linear), rows = transposed(inverse_map);
      const double scale = max_component(Vec3{length(rows.x), length(rows.y), length(rows.z)});
      const auto depth_of = [&](const Vec3& p) { return depth(image, inverse_map * (p - map.offset)); };
      if (depth_of(scene_.camera.position) > 0) return add_around_camera(placed, box);
      for (const auto& [i, light] : lights_)
        if (placed.shadow && depth_of(light.first) >= light.second * scale)
          add("/lights/" + std::to_string(i), "light_enclosed",
              "the opaque object " + pointer(placed) + " is around the light and hides it from everything else");
    }
  }

  /// A glowing dome, and a textured one in ambient light, are meant to be seen from inside.
  void add_around_camera(const Placed& placed, const Bounds& box) {
    const Material& material = scene_.materials[placed.material.index];
    const auto* emission = std::get_if<Color>(&material.emission);
    const bool is_dome = emission == nullptr || !is_black(*emission) ||
                         (std::holds_alternative<TextureId>(material.color) && !is_black(scene_.ambient));
    if (!around_camera_.empty() && length(box.high - box.low) >= length(around_camera_.high - around_camera_.low))
      return;
    around_camera_ = box;
    camera_detail_ =
        is_dome ? "" : "is inside the opaque object " + pointer(placed) + ", in which there is nothing else";
  }

  /// A room is the smallest solid around the camera, too, but has a light or an object in it.
  void check_around_camera() {
    if (camera_detail_.empty()) return;
    std::size_t content = 0;
    for (const Light& light : scene_.lights)
      if (const auto sphere = extent(light.source); sphere && is_in(around_camera_, sphere->first)) ++content;
    for_each_placed(scene_, [&](const Placed& placed) {
      const Bounds box = bounds_of(placed);
      if (!box.empty() && is_in(around_camera_, (box.low + box.high) / 2)) ++content;
    });
    if (content == 1) add("/camera/position", "camera_enclosed", camera_detail_);
  }

  void check_totals() {
    const Background& background = scene_.background;
    const bool is_dark =
        is_black(background.color) && !background.gradient && !background.environment && !background.cube;
    const bool no_ambient = !has_ambient_ || is_black(scene_.ambient);
    if (any_object_ && !is_lit_ && no_ambient && (is_dark || !reflects_))
      add("/lights", "nothing_lit", "every object is black: there is no light, no \"ambient\" and no \"emission\"");
    if (is_dark && !in_view_) add("/objects", "nothing_in_view", "the image is black: no object is in view");
    const auto others = [](std::size_t count) {
      return count > 1 ? ", and " + std::to_string(count - 1) + " more" : std::string();
    };
    if (behind_ > 0 && !reflects_) add(first_behind_, "behind_camera", "is behind the camera" + others(behind_));
    if (too_small_ > 0) add(first_too_small_, "beyond_precision", too_small_detail_ + others(too_small_));
  }

  const Scene& scene_;
  const bool has_interreflection_ = scene_.accuracy.has_interreflection(scene_.accuracy.approximate);
  const bool has_ambient_ = scene_.accuracy.has_ambient_term(scene_.accuracy.approximate);
  const View view_;
  std::vector<std::pair<std::size_t, std::pair<Vec3, double>>> lights_;  ///< numbers and spheres
  std::vector<Issue> found_;
  bool is_lit_ = false, reflects_ = false, any_object_ = false, in_view_ = false;
  std::size_t behind_ = 0, too_small_ = 0;
  std::string first_behind_, first_too_small_, too_small_detail_;
  Bounds around_camera_;  ///< box of the smallest opaque solid in which the camera is
  std::string camera_detail_;
};

}  // namespace

std::vector<Issue> warnings(const Scene& scene) { return WarningFinder(scene).find(); }

double predicted_rays(const Scene& scene) {
  constexpr std::size_t reflectors_max = 256, bins = 128, levels_max = 1024;  // a tree that is small grows linearly
  constexpr double fresnel = 0.05, rays_max = 1e9;
  if (scene.accuracy.approximate.reflections != Approximations::Reflections::exact) return 1;
  std::vector<Reflector> all;
  std::array<double, places> factors{1e-9, 1e-9, 1e-9};  // of throughput: reflected by glass and mirrors, transmitted
  for_each_placed(scene, [&](const Placed& placed) {
    const Material& material = scene.materials[placed.material.index];
    if (!(material.reflection > 0) || all.size() == reflectors_max) return;
    const Place place = lets_light_pass(material) ? glass : mirror;
    all.push_back(reflector_of(placed, place, scene.camera.position));
    factors[place] = std::max(factors[place], material.reflection * (material.fresnel ? fresnel : 1));
    const double passed = material.transmission > 0 ? material.transmission : 1;
    if (place == glass) factors[inside] = std::max(factors[inside], passed * (1 - fresnel));
  });
  using Hits = std::array<double, places>;
  std::array<Hits, bins> hits{}, next{};                // of a level, by throughput from 1 to the cutoff
  std::array<Hits, places> after{{{}, {}, {0, 0, 1}}};  // probabilities of the next hit of a ray that leaves a place
  for (const Reflector& from : all) {
    Hits sum{};
    for (const Reflector& to : all) sum[to.place] += from.hit_probability(to);
    sum[glass] = std::min(sum[glass], 0.65);
    const auto count = static_cast<double>(std::ranges::count(all, from.place, &Reflector::place));
    for (const Place to : {glass, mirror})
      after[from.place][to] += sum[to] / std::max(1.0, sum[glass] + sum[mirror]) / count;
    hits[0][from.place] += 1 / static_cast<double>(all.size());
  }
  const double least = std::log(std::min(scene.accuracy.cutoff.value_or(Accuracy::roulette_throughput), 0.99));
  for (double& factor : factors) factor = std::round(std::clamp(std::log(factor) / least, 0.0, 1.0) * bins);
  double rays = 1, added = 1;
  const auto spawn = [&](std::size_t bin, Place by, Place from, double count) {
    bin += static_cast<std::size_t>(factors[by]);
    if (bin >= bins) return;
    added += count;
    for (std::size_t to = 0; to < places; ++to) next[bin][to] += count * after[from][to];
  };
  const std::uint32_t growing = scene.accuracy.max_depth.value_or(scene.accuracy.roulette_depth()),
                      depth = scene.accuracy.max_depth.value_or(2 * growing);
  std::size_t level = 0, levels = std::min<std::size_t>(growing, levels_max);
  for (; level < levels && added > 1e-6 && rays < rays_max; ++level, rays += added) {
    added = 0;
    for (std::size_t bin = 0; bin < bins; ++bin) {
      spawn(bin, glass, glass, hits[bin][glass]);
      spawn(bin, inside, inside, hits[bin][glass]);
      spawn(bin, glass, inside, hits[bin][inside]);
      spawn(bin, inside, glass, hits[bin][inside]);
      spawn(bin, mirror, mirror, hits[bin][mirror]);
    }
    hits = std::exchange(next, {});
  }
  return std::min(rays_max, rays + added * static_cast<double>(depth - level));
}

}  // namespace tracer
