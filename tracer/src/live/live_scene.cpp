#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <set>
#include <type_traits>
#include <utility>

#include "tracer/live.h"
#include "tracer/src/accel/primitive_bounds.h"
#include "tracer/src/compiled/compiled_scene.h"
#include "tracer/src/live/live_bvh.h"
#include "tracer/src/materials/compiled_material.h"
#include "tracer/src/math/rounding.h"

namespace tracer {
namespace {

void add_cell(std::vector<float>& table, const Vec3& v, double w) {
  for (const double value : {v.x, v.y, v.z, w}) table.push_back(static_cast<float>(value));
}
void add_cell(std::vector<float>& table, const Color& c, double w) { add_cell(table, Vec3{c.r, c.g, c.b}, w); }
void add_cell(std::vector<float>& table, double x, double y, double z, double w) { add_cell(table, Vec3{x, y, z}, w); }

std::size_t cells(const std::vector<float>& table) { return table.size() / 4; }

template <class Enumerator>
double number(Enumerator value) {
  return static_cast<double>(value);
}

// ---- geometry

/// The cells of primitives, and the tables that they name.
class GeometryWriter {
 public:
  GeometryWriter(const GeometrySet& set, LiveScene& live) : set_(set), live_(live) {}

  std::vector<LivePrimitive> write() {
    std::uint32_t number = 0;
    for (const SphereGeometry& spheres : set_.spheres) add(spheres, number++);
    for (const TriangleGeometry& mesh : set_.triangles) add(mesh, number++);
    for (const QuadricGeometry& quadrics : set_.quadrics) add(quadrics, number++);
    const PlaneGeometry& planes = set_.planes;
    for (std::size_t i = 0; i < planes.point.size(); ++i) {
      add_cell(live_.planes, planes.point[i], code(planes.object[i], planes.transmissive[i] != 0));
      add_cell(live_.planes, planes.normal[i], 0);
    }
    return std::move(primitives_);
  }

  /// Size of the smallest shape, mesh or triangle on its own.
  [[nodiscard]] double smallest() const { return smallest_; }

 private:
  static double code(std::uint32_t object, bool transmissive) { return 2.0 * object + (transmissive ? 1 : 0); }

  void add(const SphereGeometry& spheres, std::uint32_t geometry) {
    for (std::uint32_t i = 0; i < spheres.x.size(); ++i) {
      push({geometry, i}, {-1, number(cells(live_.shapes)), 0}, code(spheres.object[i], spheres.transmissive));
      add_cell(live_.shapes, spheres.center(i), spheres.radius[i]);
    }
  }

  void add(const QuadricGeometry& quadrics, std::uint32_t geometry) {
    for (std::uint32_t i = 0; i < quadrics.quadrics.size(); ++i) {
      const Quadric& q = quadrics.quadrics[i];
      push({geometry, i}, {-2 - number(q.kind), number(cells(live_.shapes)), 0},
           code(quadrics.object[i], quadrics.transmissive));
      const Linear &in = q.shape_from_render, &out = q.render_from_shape;
      add_cell(live_.shapes, q.origin, q.radius_0);
      add_cell(live_.shapes, in.x, q.radius_1);
      add_cell(live_.shapes, in.y, q.caps ? 1 : 0);
      add_cell(live_.shapes, in.z, curvature(q));
      for (const Vec3& column : {out.x, out.y, out.z}) add_cell(live_.shapes, column, 0);
    }
  }

  void add(const TriangleGeometry& mesh, std::uint32_t geometry) {
    const double first = number(cells(live_.vertices) / 2);
    for (std::uint32_t vertex = 0; vertex < mesh.positions.size(); ++vertex) {
      const auto [u, v] = mesh.uvs.empty() ? std::array{0.0, 0.0} : mesh.uvs[vertex];
      add_cell(live_.vertices, mesh.position(vertex), u);
      add_cell(live_.vertices, mesh.normals.empty() ? Vec3{} : mesh.normal(vertex), v);
    }
    const bool is_mesh = mesh.object_of_triangle.empty();
    Bounds whole;
    for (const Vec3& position : mesh.positions) whole.include(position);
    if (is_mesh) include_size(whole);
    for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) {
      const auto& [a, b, c] = mesh.triangles[i];
      if (!is_mesh) include_size(bounds_of(set_, {geometry, i}));
      push({geometry, i}, {first + a, first + b, first + c}, code(mesh.object_of(i), mesh.transmissive));
    }
  }

  void include_size(const Bounds& box) {
    const double size = max_component(box.high - box.low);
    if (size > 0) smallest_ = std::min(smallest_, size);
  }

  void push(const PrimitiveRef& primitive, const Vec3& place, double code) {
    const Bounds box = bounds_of(set_, primitive);
    if (place.x < 0) include_size(box);
    primitives_.push_back({{rounded_down(box.low.x), rounded_down(box.low.y), rounded_down(box.low.z)},
                           {rounded_up(box.high.x), rounded_up(box.high.y), rounded_up(box.high.z)},
                           {static_cast<float>(place.x), static_cast<float>(place.y), static_cast<float>(place.z),
                            static_cast<float>(code)}});
  }

  const GeometrySet& set_;
  LiveScene& live_;
  std::vector<LivePrimitive> primitives_;
  double smallest_ = HUGE_VAL;
};

void write_objects(const CompiledScene& scene, LiveScene& live) {
  const ObjectTable& objects = scene.objects;
  live.object_cells = objects.uv_axes.empty() ? 1 : 4;
  std::vector<std::uint8_t> without_uv(objects.material.size());
  for (const TriangleGeometry& mesh : scene.geometry().triangles)
    if (mesh.uvs.empty()) without_uv[mesh.object] = 1;
  for (std::size_t i = 0; i < objects.material.size(); ++i) {
    const bool passes = i < objects.boundary.size();
    const double boundary = passes ? number(objects.boundary[i]) : 0;
    const double diagonal = passes && std::isfinite(objects.diagonal[i]) ? objects.diagonal[i] : 0x1p100;
    add_cell(live.objects, objects.material[i], objects.shadowless[i] + 2 * without_uv[i] + 4 * boundary, diagonal, 0);
    if (live.object_cells == 1) continue;
    const Axes& axes = objects.uv_axes[i];
    for (const Vec3& axis : {axes.e0, axes.e1, axes.n}) add_cell(live.objects, axis, 0);
  }
}

// ---- materials, lights, background

/// Calls write(name, value) for the colors of a material, and then for its numbers, in the order of its fields.
template <class Write>
void for_each_value(const Material& material, const Write& write) {
  for (const bool colors : {true, false})
    for_each_field<Material>([&](const auto& field) {
      const auto& value = material.*field.member;
      using Value = std::remove_cvref_t<decltype(value)>;
      constexpr bool is_number = std::is_same_v<Value, double> || std::is_same_v<Value, int>;
      if constexpr (std::is_same_v<Value, Color> || std::is_same_v<Value, ColorOrTexture>) {
        if (colors) write(field.name, ColorOrTexture(value));
      } else if constexpr (is_number) {
        if (!colors) write(field.name, static_cast<double>(value));
      }
    });
}

void write_materials(const std::vector<Material>& materials, LiveScene& live) {
  std::uint32_t next = 0;
  for_each_value(Material{}, [&](std::string_view name, const auto& value) {
    live.material_fields.emplace_back(name, next);
    next += std::is_same_v<std::remove_cvref_t<decltype(value)>, double> ? 1 : 4;
  });
  live.material_cells = (next + 3) / 4 + 1;
  for (const Material& m : materials) {
    std::vector<float>& table = live.materials;
    bool has_textures = m.normal_map || m.bump;
    for_each_value(m, [&](std::string_view /*name*/, const auto& value) {
      if constexpr (std::is_same_v<std::remove_cvref_t<decltype(value)>, double>) {
        table.push_back(static_cast<float>(value));
      } else {
        const auto* const texture = std::get_if<TextureId>(&value);
        has_textures = has_textures || texture != nullptr;
        add_cell(table, texture != nullptr ? Color{1, 1, 1} : std::get<Color>(value),
                 texture != nullptr ? 1.0 + texture->index : 0);
      }
    });
    table.resize((table.size() + 3) / 4 * 4);
    const double flags = number(m.model) + 4 * number(m.transparency) + (m.fresnel ? 16 : 0) +
                         (m.shading == Material::Shading::flat ? 32 : 0) + (has_textures ? 64 : 0);
    add_cell(table, flags, m.normal_map ? 1.0 + m.normal_map->index : 0, m.bump ? 1.0 + m.bump->texture.index : 0,
             m.bump ? m.bump->scale : 0);
  }
}

void write(const Light& light, const CompiledLight& compiled, std::vector<float>& table) {
  add_cell(table, compiled.position, compiled.kind);
  add_cell(table, light.color, light.intensity);
  add_cell(table, compiled.axis, compiled.cos_inner);
  add_cell(table, compiled.u, compiled.cos_outer);
  add_cell(table, compiled.v, compiled.radius);
  const auto& [c0, c1, c2] = light.attenuation.coefficients;
  add_cell(table, c0, c1, c2, number(light.attenuation.kind));
  add_cell(table, light.shadows ? 1 : 0, 0, 0, 0);
}

void write_background(const Background& background, const CompiledBackground& compiled, std::vector<float>& table) {
  const Gradient gradient = background.gradient.value_or(Gradient{background.color, {}});
  add_cell(table, number(compiled.kind()), 0, 0, 0);
  add_cell(table, gradient.zenith, 0);
  add_cell(table, gradient.nadir, 0);
  add_cell(table, compiled.up(), 0);
  std::vector<TextureId> textures;
  if (background.environment) textures.push_back(background.environment->texture);
  if (background.cube) textures.assign(background.cube->faces.begin(), background.cube->faces.end());
  for (std::size_t i = 0; i < textures.size(); ++i) {
    const CompiledBackground::Face& face = compiled.faces()[i];
    add_cell(table, face.axis, textures[i].index);
    add_cell(table, face.right, number(face.wraps.u));
    add_cell(table, face.up, number(face.wraps.v));
  }
}

// ---- textures

/// The nearest 16-bit float (IEEE 754), at most 65504, the largest one. The product makes the numbers below its normal
/// ones those below the normal ones of 32 bits, so that one rule of rounding serves both.
std::uint32_t half_of(float value) {
  const auto bits = std::bit_cast<std::uint32_t>(std::clamp(value, 0.0F, 65504.0F) * 0x1p-112F);
  return (bits + 0xfffU + (bits >> 13 & 1)) >> 13;
}

/// Writes images once each, from the level on that lets all have the same share of the table.
class ImageWriter {
 public:
  ImageWriter(const CompiledScene& scene, const LiveLimits& limits) {
    const std::set<std::shared_ptr<const ImageMap>> all(scene.images.begin(), scene.images.end());
    constexpr std::uint64_t bytes_of_texel = 8;
    texels_max_ = std::min(limits.cells, limits.bytes / bytes_of_texel) / 2 / std::max<std::size_t>(all.size(), 1);
  }

  void write(const Texture& texture, const ImageMap* image, LiveScene& live) {
    const auto colors = std::visit(
        [](const auto& pattern) -> std::array<Color, 2> {
          if constexpr (requires { pattern.colors; })
            return pattern.colors;
          else
            return {};
        },
        texture.pattern);
    const auto* noise = std::get_if<NoiseTexture>(&texture.pattern);
    const Place place = image != nullptr ? place_of(*image, live.texels) : Place{};
    if (image != nullptr && first_level(*image) > 0)
      live.omitted.push_back({texture.path, "is shown with " + std::to_string(place.width) + " x " +
                                                std::to_string(place.height) + " texels"});
    add_cell(live.textures, number(texture.pattern.index()), number(texture.filter), number(texture.wrap),
             noise != nullptr ? noise->octaves : 0);
    add_cell(live.textures, colors[0], number(place.first));
    add_cell(live.textures, colors[1], number(place.levels));
    add_cell(live.textures, texture.scale.x, texture.scale.y, texture.offset.x, texture.offset.y);
    add_cell(live.textures, place.width, place.height, 0, 0);
    add_cell(live.textures, texture.factor, 0);
  }

 private:
  struct Place {
    std::size_t first = 0, levels = 0;
    std::uint32_t width = 0, height = 0;
  };

  [[nodiscard]] std::size_t first_level(const ImageMap& image) const {
    const auto fits = [&](const Image& level) { return std::uint64_t{level.width} * level.height <= texels_max_; };
    const std::vector<Image>& levels = image.levels();
    return std::min<std::size_t>(std::ranges::find_if(levels, fits) - levels.begin(), levels.size() - 1);
  }

  const Place& place_of(const ImageMap& image, std::vector<std::uint32_t>& texels) {
    const auto [found, is_new] = places_.try_emplace(&image);
    Place& place = found->second;
    if (!is_new) return place;
    const std::size_t level = first_level(image);
    place = {texels.size() / 2, image.levels().size() - level, image.levels()[level].width,
             image.levels()[level].height};
    for (std::size_t i = level; i < image.levels().size(); ++i) {
      const std::vector<float>& rgb = image.levels()[i].rgb;
      for (std::size_t texel = 0; texel + 2 < rgb.size(); texel += 3) {
        texels.push_back(half_of(rgb[texel]) | half_of(rgb[texel + 1]) << 16);
        texels.push_back(half_of(rgb[texel + 2]));
      }
    }
    return place;
  }

  std::uint64_t texels_max_;
  std::map<const ImageMap*, Place> places_;
};

// ---- limits

/// Empty if the tables are within the limits.
std::string exceeded_limit(const LiveScene& live, const LiveLimits& limits) {
  std::uint64_t bytes = live.texels.size() * sizeof(std::uint32_t);
  for (const auto& [name, table] : live_tables) {
    const std::vector<float>& values = live.*table;
    bytes += values.size() * sizeof(float);
    if (cells(values) > limits.cells)
      return "the limit of a table of the live view is " + std::to_string(limits.cells) + " cells, " + name + " has " +
             std::to_string(cells(values));
    if (!std::ranges::all_of(values, [](float value) { return std::isfinite(value); }))
      return std::string("a number of ") + name + " exceeds the range of 32-bit floats, which the live view has";
  }
  if (bytes <= limits.bytes) return {};
  return "the limit of the live view is " + std::to_string(limits.bytes) + " bytes, the scene has " +
         std::to_string(bytes);
}

}  // namespace

std::vector<LiveOmission> leave_out(Scene& scene) {
  std::vector<LiveOmission> omitted;
  const auto omit = [&](bool is_omitted, std::string pointer, std::string detail) {
    if (is_omitted) omitted.push_back({std::move(pointer), std::move(detail)});
  };
  omit(scene.accuracy.model == Accuracy::Model::global, "/accuracy/model",
       "is whitted: the ambient term stands for light between surfaces");
  omit(scene.accuracy.approximate.any(), "/accuracy/approximate", "is left out: nothing is approximated");
  omit(scene.camera.layout != Camera::Layout::single, "/camera/layout", "is left out: there is one eye");
  omit(scene.image.crop.has_value(), "/image/crop", "is left out: the whole image is shown");
  omit(scene.output.overflow == Output::Overflow::scale, "/output/overflow", "is clamp");
  omit(scene.output.palette > 0, "/output/palette", "is left out");
  for (const Material& material : scene.materials) {
    omit(is_lit_by_triangle(material.shading), material.path + "/shading", "is smooth");
    const auto* roughness = std::get_if<Color>(&material.roughness);
    omit(is_principled(material) && (roughness == nullptr || roughness->r > 0), material.path + "/roughness",
         "blurs the highlights of lights alone: mirror images are sharp");
  }
  scene.accuracy.model = Accuracy::Model::whitted;
  scene.accuracy.approximate = {};
  scene.camera.layout = Camera::Layout::single;
  return omitted;
}

Result<LiveScene, std::string> live_scene(const Scene& scene, const CompiledScene& compiled, const LiveLimits& limits) {
  LiveScene live;
  live.needs = compiled.needs;
  live.scale = compiled.frame.render_from_world(1.0);
  live.origin = compiled.frame.render_from_world(Vec3{}) * -compiled.frame.world_from_render(1.0);
  const Vec3 eye = compiled.camera.position();
  constexpr double far_away = 0x1p12;  // a step of 32-bit floats is 2^-11 of the scene there
  if (largest_component(eye) > far_away)
    live.omitted.push_back({"/camera/position", "is so far away that 32-bit floats show steps"});
  GeometryWriter geometry(compiled.geometry(), live);
  auto primitives = geometry.write();
  constexpr double tiny = 0x1p-18;  // 64 steps of 32-bit floats at the border of the scene
  if (geometry.smallest() < tiny)
    live.omitted.push_back({"/objects", "differ in size by more than 32-bit floats can hold: small ones are rough"});
  LiveBvh bvh = build_live_bvh(std::move(primitives));
  live.nodes = std::move(bvh.nodes);
  live.primitives = std::move(bvh.primitives);
  write_objects(compiled, live);
  write_materials(compiled.materials, live);
  for (std::size_t i = 0; i < compiled.lights.size(); ++i) write(scene.lights[i], compiled.lights[i], live.lights);
  ImageWriter images(compiled, limits);
  for (std::size_t i = 0; i < compiled.textures.size(); ++i)
    images.write(compiled.textures[i], compiled.images[i].get(), live);
  write_background(scene.background, *compiled.background, live.background);
  if (std::string limit = exceeded_limit(live, limits); !limit.empty()) return limit;
  return live;
}

}  // namespace tracer
