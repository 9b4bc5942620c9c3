#include "api/import_model.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <set>
#include <utility>

#include "api/src/gltf/gltf.h"
#include "api/src/import/model.h"
#include "tracer/validate.h"

namespace api {
namespace {

using tracer::Vec3;

double dot(const Vec3& a, const Vec3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
Vec3 scaled(const Vec3& a, double s) { return {a.x * s, a.y * s, a.z * s}; }
Vec3 sum(const Vec3& a, const Vec3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
Vec3 unit(const Vec3& a) { return scaled(a, 1 / std::sqrt(dot(a, a))); }
Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/// A direction of a model whose front is +z and whose top is +y, in its own frame.
Vec3 turned(const Vec3& v, bool up_is_z) { return up_is_z ? Vec3{v.x, -v.z, v.y} : v; }

/// A camera that shows all positions, three quarters from the front and above, with a margin of 5 %.
Json framed(const Model& model, double aspect) {
  constexpr double fov = 30, margin = 1.05;
  const Vec3 back = turned(unit({0.55, 0.42, 1}), model.up_is_z), world_up = turned({0, 1, 0}, model.up_is_z);
  const Vec3 right = unit(cross(world_up, back)), up = cross(back, right);
  Vec3 low = model.mesh.positions.front(), high = low;
  for (const Vec3& p : model.mesh.positions) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  const Vec3 center = scaled(sum(low, high), 0.5);
  const double tangent = std::tan(fov / 2 * std::numbers::pi / 180) / margin;
  double distance = 0;
  for (const Vec3& p : model.mesh.positions) {
    const Vec3 offset = sum(p, scaled(center, -1));
    const double side = std::max(std::abs(dot(offset, right)) / aspect, std::abs(dot(offset, up)));
    distance = std::max(distance, dot(offset, back) + side / tangent);
  }
  if (!(distance > 0)) distance = 1;
  return {{"position", vector_json(sum(center, scaled(back, distance)))},
          {"look_at", vector_json(center)},
          {"up", vector_json(world_up)},
          {"fov", fov}};
}

/// The document of a model, without members that `own` has.
Json document_of(Model& model, const Json& own) {
  const Json image = own.value("image", Json::object());
  const double height = image.value("height", 480.0);
  const double width =
      image.value("width", own.contains("image") || model.aspect == 0 ? 640.0 : std::round(height * model.aspect));
  Json document{{"version", 1}};
  if (!own.contains("image") && model.aspect > 0)
    document["image"] = {{"width", std::clamp(width, 16.0, 4096.0)}, {"height", height}};
  document["camera"] = model.camera ? *model.camera : framed(model, width / height);
  const Vec3 up = turned({0, 1, 0}, model.up_is_z), key = turned({0.5, -1, -0.8}, model.up_is_z);
  if (!model.lights.empty()) {
    document["lights"] = model.lights;
    // A matt white surface at the center is as bright as the display shows, at most.
    if (model.illuminance > 1) document["output"] = {{"exposure", rounded(-std::log2(model.illuminance))}};
  } else {
    document["background"] = {{"zenith", {0.4, 0.47, 0.56}}, {"nadir", {0.26, 0.25, 0.24}}, {"up", vector_json(up)}};
    document["lights"] = {{{"type", "directional"}, {"direction", vector_json(key)}, {"intensity", 0.5}}};
  }
  document["accuracy"] = {{"model", "global"}};
  if (!model.materials.empty()) document["materials"] = model.materials;
  document["objects"] = Json::array({std::move(model.object)});
  return document;
}

/// Members of `own` replace those of the document; definitions and objects are added to them.
void merge(const Json& own, Json& document) {
  for (const auto& [name, value] : own.items()) {
    if (name == "model" || name == "time") continue;
    Json& to = document[name];
    if (name == "objects" && to.is_array()) {
      to.insert(to.end(), value.begin(), value.end());
    } else if ((name == "materials" || name == "output") && to.is_object()) {
      to.update(value);
    } else {
      to = value;
    }
  }
}

/// The document on several lines, with vectors on one.
std::string text_of(const Json& document) {
  const std::string text = document.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
  std::string shorter;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const std::size_t end = text[i] == '[' ? text.find_first_not_of("[0123456789.,-+e \n", i) : i;
    if (end == i || end == std::string::npos || text[end] != ']') {
      shorter += text[i];
      continue;
    }
    for (; i <= end; ++i) {
      if (text[i] != ' ' && text[i] != '\n') shorter += text[i];
      if (text[i] == ',') shorter += ' ';
    }
    --i;
  }
  return shorter;
}

std::vector<tracer::Issue> bad_model(const std::string& name, const std::string& sentence) {
  return {{"/model", "bad_asset", name + ": " + sentence}};
}

}  // namespace

double rounded(double value) { return std::strtod(tracer::text_of(value, 9).c_str(), nullptr); }

Json vector_json(const Vec3& v) { return {rounded(v.x), rounded(v.y), rounded(v.z)}; }

void name_materials(Model& model) {
  std::set<std::string> used;
  for (const tracer::MeshPart& part : model.mesh.parts)
    if (model.materials.contains(part.name)) used.insert(part.name);
  for (const std::string& name : used) model.object["materials"][name] = name;
  model.object["material"] = {{"model", "principled"}, {"color", 0.8}};
}

tracer::Result<ImportedModel, std::vector<tracer::Issue>> import_model(const Document& document, const ReadAsset& read,
                                                                       const Limits& limits) {
  const std::string& name = document.model->name;
  AssetBytes bytes = read(name);
  if (!bytes) return bad_model(name, bytes.error());
  const ModelSource source{name, *std::move(bytes), document.model->time, read, limits.scene};
  auto model = gltf::is_gltf(source.bytes) ? import_gltf(source) : import_mesh(source);
  if (!model) return bad_model(name, model.error());
  Json object{{"type", "mesh"}, {"file", name}};
  object.update(model->object);
  model->object = std::move(object);
  const Json own = Json::parse(document.model->members);
  Json whole = document_of(*model, own);
  merge(own, whole);
  ImportedModel imported{text_of(whole), std::move(model->omitted)};
  auto parsed = parse_scene(imported.text, limits);
  if (!parsed) return parsed.error().issues.empty() ? bad_model(name, parsed.error().detail) : parsed.error().issues;
  return imported;
}

}  // namespace api
