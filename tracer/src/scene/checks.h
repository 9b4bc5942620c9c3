#pragma once
/// Rules for the values of a scene. Each violation is reported as an issue with its path. Used for validation and
/// warnings.

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "tracer/limits.h"
#include "tracer/scene.h"
#include "tracer/src/math/affine.h"
#include "tracer/validate.h"

namespace tracer {

/// A path in the document, as a chain on the stack: it is converted to text only for an issue. The outermost element
/// holds a complete pointer ("/objects", "/materials/red").
struct DocumentPath {
  const DocumentPath* parent = nullptr;
  std::string_view name{};
  std::size_t index = 0;  ///< when `name` is empty

  explicit DocumentPath(std::string_view pointer) : name(pointer) {}
  DocumentPath(const DocumentPath& around, std::string_view field) : parent(&around), name(field) {}
  DocumentPath(const DocumentPath& around, std::size_t element) : parent(&around), index(element) {}
  [[nodiscard]] std::string pointer() const;
};

/// Each check reports a violation and returns true if there is none, so that rules between values are checked only for
/// values that are valid themselves.
class Checks {
 public:
  Checks(const Scene& checked, const Limits& scene_limits, const std::function<bool(const Issue&)>& is_reported)
      : scene(checked), limits(scene_limits), is_reported_(is_reported) {}

  bool finite(const DocumentPath& where, double value);
  bool coordinate(const DocumentPath& where, double value);                       ///< |value| <= coordinate_max
  bool position(const DocumentPath& where, const Vec3& value);                    ///< three coordinates
  bool direction(const DocumentPath& where, const Vec3& value);                   ///< any length > 0
  bool length(const DocumentPath& where, double value);                           ///< [length_min, coordinate_max]
  bool positive(const DocumentPath& where, double value);                         ///< > 0
  bool at_least_0(const DocumentPath& where, double value);                       ///< >= 0
  bool within(const DocumentPath& where, double value, double low, double high);  ///< [low, high]
  bool not_negative(const DocumentPath& where, double value);                     ///< [0, value_max]
  bool ratio(const DocumentPath& where, double value);  ///< > 0; it and its inverse at most value_max
  bool color(const DocumentPath& where, const Color& value);
  bool reference(const DocumentPath& where, std::string_view kind, std::size_t index,
                 std::size_t count);  ///< index < count
  bool texture(const DocumentPath& where, TextureId id) {
    return reference(where, "texture", id.index, scene.textures.size());
  }
  bool vec2(const DocumentPath& where, const Vec2& value);  ///< |components| <= value_max
  bool count(const DocumentPath& where, std::uint64_t value, std::uint64_t bound, std::string_view limit);

  bool add_issue(const DocumentPath& where, std::string_view code, const std::string& detail);  ///< always false
  bool over(const DocumentPath& where, std::string_view limit, const std::string& bound, const std::string& seen);
  std::vector<Issue> take();

  const Scene& scene;
  const Limits& limits;

 private:
  const std::function<bool(const Issue&)>& is_reported_;
  std::vector<Issue> issues_;
  std::uint64_t omitted_ = 0;
};

/// True if two directions are equal or opposite to within the last few bits, so that they span no plane.
/// Precondition: neither is zero.
bool parallel(const Vec3& a, const Vec3& b);

/// Ranges of the fields of one part of a scene, and rules between them. Rules apply to values within their own ranges
/// only; other values have issues of their own.
class FieldChecks {
 public:
  FieldChecks(Checks& checks, const DocumentPath& owner) : checks_(checks), owner_(owner) {}

  /// Ranges of all fields but `except`.
  template <HasFields Owner>
  void ranges(const Owner& owner, std::string_view except = {}) {
    for_each_field<Owner>([&](const auto& field) {
      if (field.name != except) range({owner_, field.name}, field.range, owner.*field.member);
    });
  }

  void not_parallel(std::string_view field, const Vec3& value, const Vec3& axis, std::string_view sentence);
  void not_parallel(std::string_view field, const std::optional<Vec3>& value, const Vec3& axis,
                    std::string_view sentence) {
    if (value) not_parallel(field, *value, axis, sentence);
  }
  bool apart(std::string_view field, const Vec3& value, const Vec3& other, std::string_view sentence);
  void all_greater(std::string_view field, const Vec3& value, const Vec3& other, std::string_view sentence);
  void has_area(std::string_view field, const Vec3& corner, const Vec3& edge, const Vec3& other_edge,
                std::string_view sentence);
  void less(std::string_view field, double value, std::string_view bound_name, double bound);
  void at_least(std::string_view field, double value, std::string_view bound_name, double bound);
  [[nodiscard]] bool is_direction(const Vec3& v) const {
    return is_position(v) && largest_component(v) >= checks_.limits.length_min;
  }

 private:
  bool range(const DocumentPath& where, const FieldRange& range, const Vec3& value) {
    return range.kind == FieldRange::direction ? checks_.direction(where, value) : checks_.position(where, value);
  }
  bool range(const DocumentPath& where, const FieldRange&, const Vec2& value) { return checks_.vec2(where, value); }
  bool range(const DocumentPath& where, const FieldRange&, const Color& value) { return checks_.color(where, value); }
  bool range(const DocumentPath& where, const FieldRange&, TextureId id) { return checks_.texture(where, id); }
  bool range(const DocumentPath& where, const FieldRange&, AssetId id) {
    return checks_.reference(where, "asset", id.index, checks_.scene.assets.size());
  }
  bool range(const DocumentPath& where, const FieldRange& kind, const ColorOrTexture& value) {
    return std::visit([&](const auto& form) { return range(where, kind, form); }, value);
  }
  bool range(const DocumentPath& where, const FieldRange&, const Attenuation& attenuation);
  bool range(const DocumentPath& where, const FieldRange& range, double value);
  template <class T>
  requires std::is_enum_v<T> || std::is_integral_v<T>
  bool range(const DocumentPath& where, const FieldRange& range, T value) {
    return range.kind != FieldRange::interval ||
           checks_.within(where, static_cast<double>(value), range.least, range.most);
  }
  template <HasFields T>
  bool range(const DocumentPath& where, const FieldRange&, const T& value) {
    FieldChecks(checks_, where).ranges(value);
    return true;
  }
  template <class T>
  bool range(const DocumentPath& where, const FieldRange& kind, const std::optional<T>& value) {
    return !value || range(where, kind, *value);
  }
  template <class T, std::size_t n>
  bool range(const DocumentPath& where, const FieldRange& kind, const std::array<T, n>& values) {
    bool all_valid = true;
    for (std::size_t i = 0; i < n; ++i) all_valid &= range({where, i}, kind, values[i]);
    return all_valid;
  }
  template <class T>
  bool range(const DocumentPath& where, const FieldRange&, const std::vector<T>& words) {
    bool all_valid = true;
    std::set<T> named;
    for (std::size_t i = 0; i < words.size(); ++i)
      all_valid &= named.insert(words[i]).second || checks_.add_issue({where, i}, "duplicate_value", "is named twice");
    return all_valid;
  }
  [[nodiscard]] bool is_position(const Vec3& v) const {
    return largest_component(v) <= checks_.limits.coordinate_max && !std::isnan(v.x + v.y + v.z);
  }

  Checks& checks_;
  const DocumentPath& owner_;
};

/// Checks objects, prototypes and their totals after instancing (validate_objects.cpp).
void check_objects(Checks& checks, const Scene& scene);

inline constexpr std::size_t compared_lights_max = 64;  ///< compared with every object

/// The sphere around a light; unset for directional lights.
std::optional<std::pair<Vec3, double>> extent(const LightSource& source);

/// Warnings of light that a document seems to have and that its image lacks (light_analysis.cpp).
std::vector<Issue> light_warnings(const Scene& scene);

}  // namespace tracer
