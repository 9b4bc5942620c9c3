#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "api/reader/issue_text.h"
#include "api/src/gltf/file.h"

namespace api::gltf {
namespace {

/// Extensions that are carried over or change nothing.
constexpr std::string_view known_extensions[] = {"KHR_materials_emissive_strength",
                                                 "KHR_materials_ior",
                                                 "KHR_materials_transmission",
                                                 "KHR_materials_clearcoat",
                                                 "KHR_materials_unlit",
                                                 "KHR_materials_volume",
                                                 "KHR_materials_diffuse_transmission",
                                                 "KHR_materials_specular"};

using Numbers = std::array<double, 3>;
constexpr Numbers white{1, 1, 1};
constexpr double number_max = 1e30;

Json color_json(const Numbers& color) {
  if (color[0] == color[1] && color[1] == color[2]) return color[0];
  return color;
}

/// True for a PNG with alpha: color type 4 or 6, or a chunk tRNS before the data (ISO/IEC 15948).
bool has_alpha(Bytes bytes) {
  const std::string_view png(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  if (!png.starts_with("\x89PNG")) return false;
  const std::string_view head = png.substr(0, std::min(png.find("IDAT"), png.size()));
  return head.size() > 25 && (head[25] == 4 || head[25] == 6 || head.find("tRNS") != std::string_view::npos);
}

class MaterialReader {
 public:
  MaterialReader(File& file, const ModelFiles& files, const Omit& omit, const Cursor& at)
      : file_(file), files_(files), omit_(omit), at_(at) {}

  Json read() {
    if (const auto extensions = file_.member(at_, "extensions")) omit_unknown(*extensions);
    omit_member(at_, "occlusionTexture");
    const auto pbr = file_.member(at_, "pbrMetallicRoughness");
    std::array<double, 4> base{1, 1, 1, 1};
    if (pbr) read_numbers(*pbr, "baseColorFactor", base);
    const auto texture = pbr ? file_.member(*pbr, "baseColorTexture") : std::nullopt;
    const Json color = product({base[0], base[1], base[2]}, texture, {});
    const bool unlit = file_.extension(at_, "KHR_materials_unlit").has_value();
    Json material{{"model", "principled"}};
    if (unlit) {
      material.update({{"color", 0}, {"specular", 0}, {"emission", color}});
    } else {
      material["color"] = color;
      add_facets(pbr, material);
      add_coat(material);
      add_transmission(material);
      add_emission(material);
      add_normals(material);
    }
    add_opacity(base[3], texture, material);
    return material;
  }

 private:
  void omit(const Cursor& at, std::string_view what) { omit_(at, what); }
  void omit_member(const Cursor& at, std::string_view name) {
    if (const auto found = file_.member(at, name)) omit(*found, name);
  }

  void omit_unknown(const Cursor& extensions) {
    for (const Cursor& extension : file_.members(extensions))
      if (std::ranges::find(known_extensions, extension.key) == std::end(known_extensions))
        omit(extensions, extension.key);
  }

  template <std::size_t N>
  void read_numbers(const Cursor& at, std::string_view name, std::array<double, N>& values) {
    if (const auto field = file_.member(at, name)) {
      file_.numbers(*field, values);
      for (const double value : values)
        if (!(value >= 0 && value <= number_max)) refuse(*field, "must be numbers from 0 on");
    }
  }

  double number_or(const std::optional<Cursor>& at, std::string_view name, double high, double fallback) {
    return at ? file_.number_or(*at, name, 0, high, fallback) : fallback;
  }

  /// A color, or a texture with that factor.
  Json product(const Numbers& factor, const std::optional<Cursor>& info, const Json& fields) {
    Json texture = info ? read_texture(*info) : Json();
    if (texture.is_null()) return color_json(factor);
    if (!fields.is_null()) texture.update(fields);
    if (factor != white) texture["factor"] = color_json(factor);
    return texture;
  }
  Json product(double factor, const std::optional<Cursor>& info, const char* channel) {
    return product({factor, factor, factor}, info, {{"channel", channel}, {"color_space", "linear"}});
  }

  /// Section 3.9.2.
  void add_facets(const std::optional<Cursor>& pbr, Json& material) {
    const auto texture = pbr ? file_.member(*pbr, "metallicRoughnessTexture") : std::nullopt;
    material["metallic"] = product(number_or(pbr, "metallicFactor", 1, 1), texture, "blue");
    material["roughness"] = product(number_or(pbr, "roughnessFactor", 1, 1), texture, "green");
    if (const auto ior = file_.extension(at_, "KHR_materials_ior"))
      material["ior"] = std::max(file_.number_or(*ior, "ior", 0, number_max, 1.5), 1.0);
    const auto specular = file_.extension(at_, "KHR_materials_specular");
    if (!specular) return;
    if (const double factor = file_.number_or(*specular, "specularFactor", 0, 1, 1); factor != 1)
      material["specular"] = factor;
    Numbers color = white;
    read_numbers(*specular, "specularColorFactor", color);
    const auto color_texture = file_.member(*specular, "specularColorTexture"),
               alpha = file_.member(*specular, "specularTexture");
    if (color_texture && alpha) omit(*alpha, "specularTexture beside specularColorTexture");
    if (color_texture || color != white) {
      material["specular_color"] = product(color, color_texture, {});
    } else if (alpha) {
      material["specular_color"] = product(white, alpha, {{"channel", "alpha"}});
    }
  }

  void add_coat(Json& material) {
    const auto coat = file_.extension(at_, "KHR_materials_clearcoat");
    if (!coat) return;
    material["coat"] =
        product(file_.number_or(*coat, "clearcoatFactor", 0, 1, 0), file_.member(*coat, "clearcoatTexture"), "red");
    material["coat_roughness"] = product(file_.number_or(*coat, "clearcoatRoughnessFactor", 0, 1, 0),
                                         file_.member(*coat, "clearcoatRoughnessTexture"), "green");
    omit_member(*coat, "clearcoatNormalTexture");
  }

  void add_transmission(Json& material) {
    if (const auto diffuse = file_.extension(at_, "KHR_materials_diffuse_transmission")) {
      material["diffuse_transmission"] = file_.number_or(*diffuse, "diffuseTransmissionFactor", 0, 1, 0);
      omit_member(*diffuse, "diffuseTransmissionTexture");
      Numbers color = white;
      read_numbers(*diffuse, "diffuseTransmissionColorFactor", color);
      material["diffuse_transmission_color"] =
          product(color, file_.member(*diffuse, "diffuseTransmissionColorTexture"), {});
    }
    const auto clear = file_.extension(at_, "KHR_materials_transmission");
    if (!clear) return;
    const double factor = file_.number_or(*clear, "transmissionFactor", 0, 1, 0);
    if (factor == 0) return;
    material["transmission"] = factor;
    if (const auto texture = file_.member(*clear, "transmissionTexture"))
      material["transmission_color"] = product(1, texture, "red");
    const auto volume = file_.extension(at_, "KHR_materials_volume");
    if (number_or(volume, "thicknessFactor", number_max, 0) == 0) {  // a thin sheet
      material["transparency"] = "filtered";
      return;
    }
    omit_member(*volume, "thicknessTexture");
    Numbers color = white;
    read_numbers(*volume, "attenuationColor", color);
    const double distance = file_.number_or(*volume, "attenuationDistance", 0, 1e300, 0);
    if (distance == 0 || color == white) return;
    // A color of 0 would be an infinite absorption.
    for (double& channel : color) channel = -std::log(std::clamp(channel, 1e-6, 1.0)) / distance;
    material["absorption"] = color_json(color);
  }

  void add_emission(Json& material) {
    const double strength =
        number_or(file_.extension(at_, "KHR_materials_emissive_strength"), "emissiveStrength", number_max, 1);
    Numbers color{};
    read_numbers(at_, "emissiveFactor", color);
    for (double& channel : color) channel *= strength;
    if (color != Numbers{}) material["emission"] = product(color, file_.member(at_, "emissiveTexture"), {});
  }

  void add_normals(Json& material) {
    const auto info = file_.member(at_, "normalTexture");
    Json texture = info ? read_texture(*info) : Json();
    if (texture.is_null()) return;
    texture["color_space"] = "linear";
    material["normal_map"] = std::move(texture);
    if (const double scale = file_.number_or(*info, "scale", -number_max, number_max, 1); scale != 1)
      material["normal_scale"] = scale;
  }

  void add_opacity(double alpha, const std::optional<Cursor>& info, Json& material) {
    const std::string mode = file_.text_or(at_, "alphaMode", "OPAQUE");
    if (mode == "OPAQUE") return;
    if (mode != "MASK" && mode != "BLEND") refuse(at_, "the alphaMode must be OPAQUE, MASK or BLEND");
    if (material.contains("transmission") && !material.contains("transparency"))
      return omit(at_, "the opacity of glass");
    const bool has_texture = info && texture_has_alpha(*info);
    if (alpha == 1 && !has_texture) return;
    material["opacity"] = product({alpha, alpha, alpha}, has_texture ? info : std::nullopt, {{"channel", "alpha"}});
    if (mode == "MASK") material["opacity_cutoff"] = std::max(file_.number_or(at_, "alphaCutoff", 0, 1, 0.5), 1e-9);
  }

  bool texture_has_alpha(const Cursor& info) {
    const auto image = image_of(info);
    if (!image) return false;
    if (const auto content = file_.image(*image)) return has_alpha(*content);
    const auto content = files_.read(files_.path_of(*file_.member(*image, "uri")));
    return content && has_alpha(*content);
  }

  std::optional<Cursor> image_of(const Cursor& info) {
    const Cursor& texture = file_.target(file_.required_member(info, "index"), "textures");
    const auto source = file_.member(texture, "source");
    return source ? std::optional(file_.target(*source, "images")) : std::nullopt;
  }

  /// The texture of a textureInfo (section 3.8.3); null if it is not carried over.
  Json read_texture(const Cursor& info) {
    const Cursor& texture = file_.target(file_.required_member(info, "index"), "textures");
    const auto transform = file_.extension(info, "KHR_texture_transform");
    const std::uint64_t coordinates =
        file_.integer_or(transform.value_or(info), "texCoord", 1000, file_.integer_or(info, "texCoord", 1000, 0));
    if (coordinates != 0) return omit(info, "a texture with other coordinates than TEXCOORD_0"), Json();
    const auto image = image_of(info);
    if (!image) return omit(texture, "a texture in the format of an extension"), Json();
    Json made;
    const auto uri = file_.member(*image, "uri");
    if (uri && is_external(*uri)) {
      made["file"] = files_.path_of(*uri);
    } else {
      const auto content = *file_.image(*image);
      const std::string_view text(reinterpret_cast<const char*>(content.data()), content.size());
      if (!text.starts_with("\x89PNG") && !text.starts_with("\xFF\xD8\xFF"))
        return omit(*image, "an image that is neither PNG nor JPEG"), Json();
      made = {{"file", files_.name}, {"image", image->index}};
    }
    add_sampler(texture, made);
    if (transform) add_transform(*transform, made);
    return made;
  }

  void add_sampler(const Cursor& texture, Json& made) {
    const auto reference = file_.member(texture, "sampler");
    if (!reference) return;
    const Cursor& sampler = file_.target(*reference, "samplers");
    const std::uint64_t s = file_.integer_or(sampler, "wrapS", 65535, 10497),
                        t = file_.integer_or(sampler, "wrapT", 65535, 10497);
    if (s != t) omit(sampler, "a wrapT unlike wrapS");
    if (s == 33071) made["wrap"] = "clamp";
    if (s == 33648) made["wrap"] = "mirror";
    if (file_.integer_or(sampler, "magFilter", 65535, 0) == 9728) made["filter"] = "nearest";
  }

  /// In glTF v points down: v' = s v + o there is 1 - v' = s (1 - v) + 1 - o - s from below.
  void add_transform(const Cursor& transform, Json& made) {
    std::array<double, 2> scale{1, 1}, offset{};
    if (const auto at = file_.member(transform, "scale")) file_.numbers(*at, scale);
    if (const auto at = file_.member(transform, "offset")) file_.numbers(*at, offset);
    if (file_.number_or(transform, "rotation", -number_max, number_max, 0) != 0)
      omit(transform, "the rotation of a texture");
    if (scale != std::array{1.0, 1.0}) made["scale"] = scale;
    const std::array from_below{offset[0], 1 - offset[1] - scale[1]};
    if (from_below != std::array{0.0, 0.0}) made["offset"] = from_below;
  }

  File& file_;
  const ModelFiles& files_;
  const Omit& omit_;
  Cursor at_;
};

}  // namespace

Json read_materials(File& file, const ModelFiles& files, const Omit& omit) {
  Json materials = Json::object();
  for (const Cursor& at : file.all("materials")) {
    std::string own = file.text_or(at, "name", "");
    if (own.empty()) own = "#" + std::to_string(at.index);
    if (materials.contains(own)) {
      omit(at, "a second material " + api::quoted(own));
    } else {
      materials[own] = MaterialReader(file, files, omit, at).read();
    }
  }
  return materials;
}

}  // namespace api::gltf
