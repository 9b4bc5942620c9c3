#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <set>
#include <span>

#include "api/reader/issue_text.h"
#include "api/src/import/model.h"
#include "tracer/mesh_file.h"

namespace api {
namespace {

using Words = std::vector<std::string>;

/// A statement of a text file, after its comments are removed and lines that end in a backslash are joined.
struct Statement {
  std::size_t line = 0;
  Words words;
};

/// Statements that begin with one of these letters.
std::vector<Statement> statements_of(std::string_view text, std::string_view letters) {
  std::vector<Statement> statements;
  std::size_t line = 0;
  while (!text.empty()) {
    ++line;
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string own(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
    const std::size_t first_line = line;
    while (!text.empty() && (own.ends_with('\\') || own.ends_with("\\\r"))) {
      own.resize(own.rfind('\\'));
      const std::size_t next = std::min(text.find('\n'), text.size());
      own.append(" ").append(text.substr(0, next));
      text.remove_prefix(std::min(next + 1, text.size()));
      ++line;
    }
    own.resize(std::min(own.find('#'), own.size()));
    const std::size_t first = own.find_first_not_of(" \t\r");
    if (first == std::string::npos || letters.find(own[first]) == std::string_view::npos) continue;
    Statement& statement = statements.emplace_back(Statement{first_line, {}});
    for (std::size_t at = first; at != std::string::npos; at = own.find_first_not_of(" \t\r", at)) {
      const std::size_t stop = std::min(own.find_first_of(" \t\r", at), own.size());
      statement.words.push_back(own.substr(at, stop - at));
      at = stop;
    }
  }
  return statements;
}

std::string joined(std::span<const std::string> words) {
  std::string text;
  for (const std::string& word : words) text.append(text.empty() ? "" : " ").append(word);
  return text;
}

std::optional<double> number_in(const std::string& word) {
  double value = 0;
  const char* const begin = word.data() + (word.starts_with('+') ? 1 : 0);
  const auto [end, error] = std::from_chars(begin, word.data() + word.size(), value);
  return error == std::errc() && end == word.data() + word.size() && std::isfinite(value) ? std::optional(value)
                                                                                          : std::nullopt;
}

/// The materials of an MTL file (Wavefront, "MTL material format", 1995) as principled ones: Ks is twice the factor of
/// a reflectance of 4 %, as programs that write it use it, and Ns has the width of Blinn's highlight, n = 2 / a^2 - 2
/// (Walter et al. 2007, section 5.2).
class MtlReader {
 public:
  MtlReader(const ModelSource& source, const std::string& path, Model& model)
      : source_(source), path_(path), model_(model) {}

  void read(std::string_view text) {
    for (const Statement& statement : statements_of(text, "nKNTdimPbr")) {
      line_ = statement.line;
      const std::span<const std::string> values(statement.words.begin() + 1, statement.words.end());
      if (statement.words[0] == "newmtl") {
        finish();
        name_ = joined(values);
        first_line_ = line_;
      } else if (!name_.empty()) {
        add(statement.words[0], values);
      }
    }
    finish();
  }

 private:
  void omit(std::size_t line, const std::string& what) {
    model_.omitted.push_back(path_ + ":" + std::to_string(line) + ": " + what + " is not carried over");
  }

  void add(const std::string& keyword, std::span<const std::string> values) {
    std::vector<double> numbers;
    for (std::size_t i = 0; i < std::min<std::size_t>(values.size(), 3) && number_in(values[i]); ++i)
      numbers.push_back(number_in(values[i]).value_or(0));
    const bool has_number = !numbers.empty();
    if (keyword.starts_with("map_") || keyword == "norm") {
      maps_[keyword] = texture(keyword, values);
    } else if (has_number && (keyword == "Kd" || keyword == "Ks" || keyword == "Ke" || keyword == "Tf")) {
      numbers.resize(3, numbers.front());
      colors_[keyword] = numbers;
    } else if (has_number && (keyword == "Ns" || keyword == "Ni" || keyword == "d" || keyword == "Tr" ||
                              keyword == "illum" || keyword == "Pr" || keyword == "Pm")) {
      numbers_[keyword] = numbers.front();
    } else if (keyword != "Ka") {
      omit(line_, keyword);
    }
  }

  Json texture(const std::string& keyword, std::span<const std::string> values) {
    Json made;
    std::size_t i = 0;
    const auto numbers = [&](std::size_t most) {
      std::vector<double> found;
      while (found.size() < most && i < values.size() && number_in(values[i])) found.push_back(*number_in(values[i++]));
      found.resize(2, found.empty() ? 0 : found.front());
      return found;
    };
    while (i < values.size() && values[i].starts_with('-') && !number_in(values[i])) {
      const std::string& option = values[i++];
      if (option == "-s") {
        made["scale"] = numbers(3);
      } else if (option == "-o") {
        made["offset"] = numbers(3);
      } else if (option == "-bm") {
        made["normal_scale"] = numbers(1).front();
      } else {
        if (option == "-clamp" && i < values.size() && values[i] == "on") made["wrap"] = "clamp";
        if (option == "-imfchan" && i < values.size() && values[i] == "m") made["channel"] = "alpha";
        if (option != "-clamp" && option != "-imfchan") omit(line_, std::string(keyword).append(" ").append(option));
        i += option == "-mm" ? 2 : 1;
      }
    }
    std::string file = joined(values.subspan(std::min(i, values.size())));
    std::ranges::replace(file, '\\', '/');
    if (file.empty()) return {};
    made["file"] = source_.beside(file);
    return made;
  }

  /// The color, or the texture with that factor.
  Json color_of(const char* color, const char* map, const Json& fallback) {
    const auto plain = colors_.find(color);
    Json own = plain == colors_.end() ? fallback : plain->second;
    const auto texture = maps_.find(map);
    if (texture == maps_.end() || texture->second.is_null()) return own;
    Json made = texture->second;
    if (plain != colors_.end() && own != Json(0.0) && own != Json{0.0, 0.0, 0.0} && own != Json{1.0, 1.0, 1.0} &&
        own != Json(1.0))
      made["factor"] = own;
    maps_.erase(texture);
    return made;
  }

  double number_or(const char* name, double fallback) const {
    const auto found = numbers_.find(name);
    return found == numbers_.end() ? fallback : found->second;
  }

  void finish() {
    if (!name_.empty() && !model_.materials.contains(name_)) model_.materials[name_] = material();
    for (const auto& [keyword, texture] : maps_) omit(first_line_, keyword + " of " + api::quoted(name_));
    maps_.clear();
    colors_.clear();
    numbers_.clear();
    name_.clear();
  }

  Json material() {
    const int illumination = static_cast<int>(number_or("illum", 2));
    const double present = std::clamp(number_or("d", 1 - number_or("Tr", 0)), 0.0, 1.0);
    const bool glass = illumination == 4 || illumination == 6 || illumination == 7 || illumination == 9;
    Json made{{"model", "principled"}, {"color", color_of("Kd", "map_Kd", 0.8)}};
    if (illumination == 0) return {{"model", "principled"}, {"color", 0}, {"specular", 0}, {"emission", made["color"]}};
    const double exponent = std::max(number_or("Ns", 10), 0.0);
    made["roughness"] = rounded(numbers_.contains("Pr") ? std::clamp(number_or("Pr", 0.5), 0.0, 1.0)
                                                        : std::pow(2 / (exponent + 2), 0.25));
    if (numbers_.contains("Pm")) made["metallic"] = std::clamp(number_or("Pm", 0), 0.0, 1.0);
    if (illumination < 2) made["specular"] = 0;
    if (const Json specular = color_of("Ks", "map_Ks", 0); illumination >= 2 && specular != Json(0)) {
      const double strength = specular.is_object() ? 0.5 : largest(specular);
      made["specular"] = std::min(2 * strength, 1.0);
      if (specular.is_object()) made["specular_color"] = specular;
      // A mirror: Ks is its reflectance.
      if ((illumination == 3 || illumination == 8) && strength > 0.1) {
        made["metallic"] = 1;
        made["color"] = specular;
        made["specular"] = 1;
      }
    }
    if (numbers_.contains("Ni")) made["ior"] = std::max(number_or("Ni", 1.5), 1.0);
    if (const Json emission = color_of("Ke", "map_Ke", 0); emission.is_object() || largest(emission) > 0)
      made["emission"] = emission;
    if (glass) {
      made["transmission"] = 1;
      made["color"] = color_of("Tf", "", 1);
    } else if (maps_.contains("map_d") || present < 1) {
      made["opacity"] = opacity(present);
    }
    if (const auto normals = maps_.find("norm"); normals != maps_.end() && !normals->second.is_null()) {
      Json texture = normals->second;
      if (texture.contains("normal_scale")) made["normal_scale"] = texture["normal_scale"];
      texture.erase("normal_scale");
      texture["color_space"] = "linear";
      made["normal_map"] = texture;
      maps_.erase(normals);
    }
    return made;
  }

  /// MTL's d is one number: the alpha of an image, or its luminance if it has none.
  Json opacity(double present) {
    const auto found = maps_.find("map_d");
    if (found == maps_.end() || found->second.is_null()) return present;
    Json texture = found->second;
    maps_.erase(found);
    if (!texture.contains("channel")) {
      const auto content = source_.read(texture["file"].get<std::string>());
      const bool alpha = content && content->size() > 25 && (*content)[1] == 'P' && ((*content)[25] & 4U) != 0;
      texture["channel"] = alpha ? "alpha" : "luminance";
    }
    if (present < 1) texture["factor"] = present;
    return texture;
  }

  static double largest(const Json& color) {
    if (!color.is_array()) return color.get<double>();
    double most = 0;
    for (const Json& channel : color) most = std::max(most, channel.get<double>());
    return most;
  }

  const ModelSource& source_;
  const std::string& path_;
  Model& model_;
  std::string name_;
  std::size_t line_ = 0, first_line_ = 0;
  std::map<std::string, Json> colors_, maps_;
  std::map<std::string, double> numbers_;
};

void read_materials(const ModelSource& source, std::string_view text, Model& model) {
  std::set<std::string> libraries;
  for (const Statement& statement : statements_of(text, "m")) {
    if (statement.words[0] != "mtllib") continue;
    // A name may have blanks; else there are several.
    Words names{joined(std::span(statement.words).subspan(1))};
    if (!source.read(source.beside(names.front()))) names.assign(statement.words.begin() + 1, statement.words.end());
    for (std::string& name : names) {
      std::ranges::replace(name, '\\', '/');
      const std::string path = source.beside(name);
      if (!libraries.insert(path).second) continue;
      if (const auto content = source.read(path)) {
        MtlReader(source, path, model).read({reinterpret_cast<const char*>(content->data()), content->size()});
      } else {
        model.omitted.push_back(source.name + ":" + std::to_string(statement.line) + ": " + path + ": " +
                                content.error());
      }
    }
  }
}

}  // namespace

tracer::Result<Model, std::string> import_mesh(const ModelSource& source) {
  auto mesh = tracer::read_mesh_file(source.bytes, source.limits, false);
  if (!mesh) return mesh.error();
  Model model;
  model.mesh = *std::move(mesh);
  const std::string_view text(reinterpret_cast<const char*>(source.bytes.data()), source.bytes.size());
  const bool is_ply = text.starts_with("ply");
  // A binary STL has 80 bytes and the number of its triangles before them; CAD programs have z up.
  model.up_is_z = text.starts_with("solid") || text.size() == 84 + 50 * model.mesh.triangles.size();
  if (!model.up_is_z && !is_ply) read_materials(source, text, model);
  name_materials(model);
  // Scans are smooth; an OBJ is where it has a smoothing group.
  const auto is_smooth = [](const Statement& s) {
    return s.words[0] == "s" && s.words.size() == 2 && s.words[1] != "off" && s.words[1] != "0";
  };
  if (model.mesh.normals.empty() && !model.up_is_z &&
      (is_ply || std::ranges::any_of(statements_of(text, "s"), is_smooth)))
    model.object["smooth"] = true;
  return model;
}

}  // namespace api
