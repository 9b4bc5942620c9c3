#include <charconv>
#include <cmath>
#include <numbers>
#include <utility>

#include "api/reader/issue_text.h"
#include "api/src/gltf/file.h"
#include "api/src/gltf/gltf.h"
#include "api/src/import/model.h"

namespace api {
namespace {

using gltf::File;
using tracer::Vec3;

Vec3 column(const tracer::Transform& transform, std::size_t i) {
  return {transform.rows[0][i], transform.rows[1][i], transform.rows[2][i]};
}

double degrees(double radians) { return rounded(radians * 180 / std::numbers::pi); }

/// The path of a URI (RFC 3986, section 2.1).
std::string percent_decoded(std::string_view uri) {
  std::string path;
  for (std::size_t i = 0; i < uri.size(); ++i) {
    const char* const digits = uri.data() + i + 1;
    unsigned byte = 0;
    const bool escaped =
        uri[i] == '%' && i + 2 < uri.size() && std::from_chars(digits, digits + 2, byte, 16).ptr == digits + 2;
    path += escaped ? static_cast<char>(byte) : uri[i];
    i += escaped ? 2 : 0;
  }
  return path;
}

class Importer {
 public:
  explicit Importer(const ModelSource& source) : source_(source) {}

  Model run() {
    read_external_buffers();
    auto mesh = gltf::read_gltf({source_.bytes, buffers_, source_.time}, source_.limits);
    if (!mesh) throw gltf::GltfError(mesh.error());
    model_.mesh = *std::move(mesh);
    File file(source_.bytes, buffers_);
    file.open();
    const gltf::ModelFiles files{source_.name, [&](const Cursor& uri) { return path_of(uri); },
                                 [&](const std::string& path) -> std::optional<std::vector<std::uint8_t>> {
                                   auto content = source_.read(path);
                                   return content ? std::optional(*std::move(content)) : std::nullopt;
                                 }};
    const gltf::Omit omit = [&](const Cursor& at, std::string_view what) { add_omission(at, what); };
    model_.materials = gltf::read_materials(file, files, omit);
    // Section 3.9.1: the default material is white, metallic and rough in its defaults; viewers show it as a nonmetal.
    name_materials(model_);
    if (source_.time) model_.object["time"] = *source_.time;
    add_cameras_and_lights(file);
    add_other_omissions(file);
    return std::move(model_);
  }

 private:
  std::string path_of(const Cursor& uri) { return source_.beside(percent_decoded(uri.node->string())); }

  void add_omission(const Cursor& at, std::string_view what) {
    const std::string place = pointer(at);
    std::string line =
        source_.name + ": " + (place.empty() ? "its JSON" : place) + ": " + std::string(what) + " is not carried over";
    if (omissions_.insert(line).second) model_.omitted.push_back(std::move(line));
  }

  void read_external_buffers() {
    File file(source_.bytes, {});
    Json paths = Json::array();
    for (const Cursor& buffer : file.all("buffers")) {
      const auto uri = file.member(buffer, "uri");
      if (!uri || uri->node->kind != json::Kind::string || !gltf::is_external(*uri)) continue;
      paths.push_back(path_of(*uri));
      auto content = source_.read(paths.back().get<std::string>());
      if (!content) gltf::refuse(*uri, content.error());
      contents_.push_back(*std::move(content));
    }
    for (const auto& content : contents_) buffers_.emplace_back(content);
    if (!paths.empty()) model_.object["buffers"] = std::move(paths);
  }

  void add_cameras_and_lights(File& file) {
    const auto lists = file.extension(file.root(), "KHR_lights_punctual");
    const std::vector<Cursor> lights = lists ? file.list(*lists, "lights") : std::vector<Cursor>();
    for (const gltf::Placement& placement : gltf::place_nodes(file, source_.time)) {
      if (const auto camera = file.member(placement.node, "camera")) add_camera(file, *camera, placement);
      const auto reference = file.extension(placement.node, "KHR_lights_punctual");
      if (!reference) continue;
      const Cursor index = file.required_member(*reference, "light");
      if (lights.empty()) gltf::refuse(index, "there are no lights");
      add_light(file, lights[file.integer(index, lights.size() - 1)], placement.world_from_node);
    }
  }

  void add_camera(File& file, const Cursor& reference, const gltf::Placement& placement) {
    if (model_.camera) return add_omission(reference, "a further camera");
    const Cursor& at = file.target(reference, "cameras");
    const Vec3 position = column(placement.world_from_node, 3), back = column(placement.world_from_node, 2);
    const double length = std::hypot(back.x, back.y, back.z);
    if (!(length > 0)) gltf::refuse(reference, "its node has no direction");
    Json camera{{"position", vector_json(position)},
                {"look_at", vector_json({position.x - back.x / length, position.y - back.y / length,
                                         position.z - back.z / length})},
                {"up", vector_json(column(placement.world_from_node, 1))}};
    if (const auto perspective = file.member(at, "perspective")) {
      camera["fov"] = degrees(file.number(file.required_member(*perspective, "yfov"), 1e-6, std::numbers::pi - 1e-6));
      model_.aspect = file.number_or(*perspective, "aspectRatio", 1e-3, 1e3, 0);
    } else {
      const Cursor orthographic = file.required_member(at, "orthographic");
      const double y = std::abs(file.number(file.required_member(orthographic, "ymag"), -1e30, 1e30)),
                   x = std::abs(file.number(file.required_member(orthographic, "xmag"), -1e30, 1e30));
      camera["type"] = "orthographic";
      camera["height"] = rounded(2 * y);
      model_.aspect = y > 0 ? x / y : 0;
    }
    model_.camera = std::move(camera);
  }

  /// KHR_lights_punctual: intensities are candela and lux. Those of documents are pi times smaller, since a surface of
  /// color 1 has the radiance of its light there.
  void add_light(File& file, const Cursor& at, const tracer::Transform& world_from_node) {
    const std::string type = file.text_or(at, "type", "");
    const double intensity = file.number_or(at, "intensity", 0, 1e30, 1) / std::numbers::pi;
    const Vec3 position = column(world_from_node, 3), back = column(world_from_node, 2);
    Json light{{"type", type}};
    if (type != "directional") {
      light["position"] = vector_json(position);
      light["attenuation"] = "inverse_square";
    }
    if (type != "point") light["direction"] = vector_json({-back.x, -back.y, -back.z});
    std::array<double, 3> color{1, 1, 1};
    if (const auto own = file.member(at, "color")) file.numbers(*own, color);
    if (color != std::array{1.0, 1.0, 1.0}) light["color"] = color;
    light["intensity"] = rounded(intensity);
    if (type == "spot") {
      const auto spot = file.member(at, "spot");
      const double outer = spot ? file.number_or(*spot, "outerConeAngle", 0, std::numbers::pi / 2, std::numbers::pi / 4)
                                : std::numbers::pi / 4;
      light["inner_angle"] = degrees(spot ? file.number_or(*spot, "innerConeAngle", 0, outer, 0) : 0);
      light["outer_angle"] = degrees(outer);
    } else if (type != "point" && type != "directional") {
      gltf::refuse(at, "the type must be directional, point or spot");
    }
    if (const auto range = file.member(at, "range")) add_omission(*range, "the range of a light");
    model_.lights.push_back(std::move(light));
    model_.illuminance += type == "directional" ? intensity : intensity / squared_distance_to_center(position);
  }

  [[nodiscard]] double squared_distance_to_center(const Vec3& p) const {
    Vec3 sum{};
    for (const Vec3& v : model_.mesh.positions) sum = {sum.x + v.x, sum.y + v.y, sum.z + v.z};
    const auto count = static_cast<double>(model_.mesh.positions.size());
    const double d = std::hypot(p.x - sum.x / count, p.y - sum.y / count, p.z - sum.z / count);
    return std::max(d * d, 1e-12);
  }

  /// Parts that no other function lists, once each.
  void add_other_omissions(File& file) {
    const std::vector<Cursor>& animations = file.all("animations");
    if (!animations.empty() && !source_.time) add_omission(animations.front(), "the animation (without a time)");
    if (animations.size() > 1) add_omission(animations[1], "a further animation");
    bool has_colors = false, has_lines = false, has_more_joints = false;
    for (const Cursor& mesh : file.all("meshes"))
      for (const Cursor& primitive : file.list(mesh, "primitives")) {
        const auto attributes = file.member(primitive, "attributes");
        const auto once = [&](bool& seen, bool found, const char* what) {
          if (found && !std::exchange(seen, true)) add_omission(primitive, what);
        };
        once(has_colors, attributes && file.member(*attributes, "COLOR_0"), "the color of vertices");
        once(has_more_joints, attributes && file.member(*attributes, "JOINTS_1"), "a fifth joint of a vertex");
        once(has_lines, file.integer_or(primitive, "mode", 6, 4) < 4, "a primitive of points or lines");
      }
    if (const auto used = file.member(file.root(), "extensions"))
      for (const Cursor& extension : file.members(*used))
        if (extension.key != "KHR_lights_punctual") add_omission(*used, extension.key);
  }

  const ModelSource& source_;
  std::vector<std::vector<std::uint8_t>> contents_;
  std::vector<std::span<const std::uint8_t>> buffers_;
  std::set<std::string> omissions_;
  Model model_;
};

}  // namespace

tracer::Result<Model, std::string> import_gltf(const ModelSource& source) {
  return gltf::result_of([&] { return Importer(source).run(); });
}

}  // namespace api
