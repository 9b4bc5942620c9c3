#include "tracer/src/scene/checks.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <utility>

namespace tracer {
namespace {

constexpr std::size_t issues_max = 1000;  // bounds the response: a broken mesh could have millions of issues

std::string channels_of(const Color& color) {
  return "[" + text_of(color.r) + ", " + text_of(color.g) + ", " + text_of(color.b) + "]";
}

/// `v` scaled to a length of about 1, so that products neither overflow nor underflow.
Vec3 scaled_to_one(const Vec3& value) {
  const double largest = largest_component(value);
  const Vec3 v{value.x / largest, value.y / largest, value.z / largest};
  const double norm = std::sqrt(v.x * v.x + v.y * v.y + v.z * v.z);
  return {v.x / norm, v.y / norm, v.z / norm};
}

}  // namespace

std::string DocumentPath::pointer() const {
  if (parent == nullptr) return std::string(name);
  return parent->pointer() + "/" + (name.empty() ? std::to_string(index) : std::string(name));
}

std::string text_of(double value, int digits) {
  char text[32];
  char* const end = text + sizeof text;
  return {text, (digits == 0 ? std::to_chars(text, end, value)
                             : std::to_chars(text, end, value, std::chars_format::general, digits))
                    .ptr};
}

bool Checks::add_issue(const DocumentPath& where, std::string_view code, const std::string& detail) {
  if (issues_.size() == issues_max) {
    ++omitted_;
    return false;
  }
  Issue issue{where.pointer(), std::string(code), detail};
  if (!is_reported_ || !is_reported_(issue)) issues_.push_back(std::move(issue));
  return false;
}

bool Checks::over(const DocumentPath& where, std::string_view limit, const std::string& bound,
                  const std::string& seen) {
  return add_issue(where, "limit_exceeded", "the limit " + std::string(limit) + " is " + bound + ", got " + seen);
}

std::vector<Issue> Checks::take() {
  if (omitted_ > 0) issues_.push_back({"", "too_many_issues", "and " + std::to_string(omitted_) + " more"});
  return std::move(issues_);
}

bool Checks::finite(const DocumentPath& where, double value) {
  return std::isfinite(value) || add_issue(where, "not_finite", "must be a finite number");
}

bool Checks::coordinate(const DocumentPath& where, double value) {
  if (std::abs(value) <= limits.coordinate_max) return true;
  return finite(where, value) && over(where, "coordinate_max", text_of(limits.coordinate_max), text_of(value));
}

bool Checks::position(const DocumentPath& where, const Vec3& value) {
  if (largest_component(value) <= limits.coordinate_max && !std::isnan(value.x + value.y + value.z)) return true;
  const bool x = coordinate({where, std::size_t{0}}, value.x);
  const bool y = coordinate({where, std::size_t{1}}, value.y);
  const bool z = coordinate({where, std::size_t{2}}, value.z);
  return x && y && z;
}

bool Checks::direction(const DocumentPath& where, const Vec3& value) {
  if (!position(where, value)) return false;
  const double largest = largest_component(value);
  if (largest >= limits.length_min) return true;
  if (largest == 0) return add_issue(where, "degenerate", "must not be zero: it has no direction");
  return add_issue(where, "degenerate",
                   "is too short to have a direction: the limit length_min is " + text_of(limits.length_min) +
                       ", its largest component is " + text_of(largest));
}

bool Checks::positive(const DocumentPath& where, double value) {
  if (value > 0) return true;
  return finite(where, value) && add_issue(where, "out_of_range", "must be > 0, got " + text_of(value));
}

bool Checks::at_least_0(const DocumentPath& where, double value) {
  if (value >= 0) return true;
  return finite(where, value) && add_issue(where, "out_of_range", "must be >= 0, got " + text_of(value));
}

bool Checks::length(const DocumentPath& where, double value) {
  if (!finite(where, value) || !positive(where, value)) return false;
  if (value < limits.length_min) return over(where, "length_min", text_of(limits.length_min), text_of(value));
  return coordinate(where, value);
}

bool Checks::within(const DocumentPath& where, double value, double low, double high) {
  if (value >= low && value <= high) return true;
  return finite(where, value) &&
         add_issue(where, "out_of_range",
                   "must be in [" + text_of(low) + ", " + text_of(high) + "], got " + text_of(value));
}

bool Checks::not_negative(const DocumentPath& where, double value) {
  if (value >= 0 && value <= limits.value_max) return true;
  return finite(where, value) && at_least_0(where, value) &&
         over(where, "value_max", text_of(limits.value_max), text_of(value));
}

bool Checks::ratio(const DocumentPath& where, double value) {
  const double bound = limits.value_max;
  return finite(where, value) && positive(where, value) &&
         ((value <= bound && 1 / value <= bound) || over(where, "value_max", text_of(bound), text_of(value)));
}

bool Checks::reference(const DocumentPath& where, std::string_view kind, std::size_t index, std::size_t count) {
  return index < count ||
         add_issue(where, "unknown_reference", "there is no " + std::string(kind) + " " + std::to_string(index));
}

bool Checks::color(const DocumentPath& where, const Color& value) {
  const double lowest = std::min({value.r, value.g, value.b});
  const double highest = std::max({value.r, value.g, value.b});
  const double sum = value.r + value.g + value.b;  // min and max ignore NaN
  if (lowest >= 0 && highest <= limits.value_max && !std::isnan(sum)) return true;
  if (!std::isfinite(value.r) || !std::isfinite(value.g) || !std::isfinite(value.b))
    return add_issue(where, "not_finite", "every channel must be a finite number");
  if (lowest < 0) return add_issue(where, "out_of_range", "every channel must be >= 0, got " + channels_of(value));
  return over(where, "value_max", text_of(limits.value_max), text_of(highest));
}

bool Checks::vec2(const DocumentPath& where, const Vec2& value) {
  const auto component = [&](std::size_t i, double number) {
    if (std::abs(number) <= limits.value_max) return true;
    const DocumentPath place(where, i);
    return finite(place, number) && over(place, "value_max", text_of(limits.value_max), text_of(number));
  };
  const bool x = component(0, value.x);
  const bool y = component(1, value.y);
  return x && y;
}

bool Checks::count(const DocumentPath& where, std::uint64_t value, std::uint64_t bound, std::string_view limit) {
  return value <= bound || over(where, limit, std::to_string(bound), std::to_string(value));
}

bool parallel(const Vec3& a, const Vec3& b) {
  const Vec3 u = scaled_to_one(a);
  const Vec3 v = scaled_to_one(b);
  const Vec3 cross{u.y * v.z - u.z * v.y, u.z * v.x - u.x * v.z, u.x * v.y - u.y * v.x};
  return largest_component(cross) < 1e-15;  // the sine of their angle; rounding alone leaves up to 3e-16
}

void FieldChecks::not_parallel(std::string_view field, const Vec3& value, const Vec3& axis, std::string_view sentence) {
  if (is_direction(value) && is_direction(axis) && parallel(axis, value))
    checks_.add_issue({owner_, field}, "degenerate", std::string(sentence));
}

bool FieldChecks::apart(std::string_view field, const Vec3& value, const Vec3& other, std::string_view sentence) {
  if (!is_position(value) || !is_position(other)) return false;
  return largest_component(value - other) >= checks_.limits.length_min ||
         checks_.add_issue({owner_, field}, "degenerate", std::string(sentence));
}

void FieldChecks::all_greater(std::string_view field, const Vec3& value, const Vec3& other, std::string_view sentence) {
  if (!is_position(value) || !is_position(other)) return;
  const Vec3 size = value - other;
  if (std::min({size.x, size.y, size.z}) < checks_.limits.length_min)
    checks_.add_issue({owner_, field}, "degenerate", std::string(sentence));
}

void FieldChecks::has_area(std::string_view field, const Vec3& corner, const Vec3& edge, const Vec3& other_edge,
                           std::string_view sentence) {
  if (!is_position(corner) || !tracer::finite(edge) || !tracer::finite(other_edge)) return;
  const double shortest = checks_.limits.length_min * checks_.limits.length_min;
  const bool long_enough = dot(edge, edge) >= shortest && dot(other_edge, other_edge) >= shortest;
  if (!long_enough || parallel(edge, other_edge))
    checks_.add_issue({owner_, field}, "degenerate", std::string(sentence));
}

void FieldChecks::less(std::string_view field, double value, std::string_view bound_name, double bound) {
  const bool valid = value >= 0 && bound >= checks_.limits.length_min && bound <= checks_.limits.coordinate_max;
  if (valid && value >= bound && value <= checks_.limits.coordinate_max)
    checks_.add_issue({owner_, field}, "out_of_range",
                      "must be < " + std::string(bound_name) + " " + text_of(bound) + ", got " + text_of(value));
}

void FieldChecks::at_least(std::string_view field, double value, std::string_view bound_name, double bound) {
  if (value >= 0 && value < bound && bound <= 180)
    checks_.add_issue({owner_, field}, "out_of_range",
                      "must be >= " + std::string(bound_name) + " " + text_of(bound) + ", got " + text_of(value));
}

bool FieldChecks::range(const DocumentPath& where, const FieldRange&, const Attenuation& attenuation) {
  if (attenuation.kind != Attenuation::Kind::polynomial) return true;
  const auto& [c0, c1, c2] = attenuation.coefficients;
  bool all_valid = true;
  for (std::size_t i = 0; i < 3; ++i) all_valid &= checks_.not_negative({where, i}, attenuation.coefficients[i]);
  const double sum = c0 + c1 + c2;
  return all_valid &&
         (sum >= 1 / checks_.limits.value_max ||
          checks_.add_issue(where, "degenerate", "the sum of the coefficients must be > 0, got " + text_of(sum)));
}

bool FieldChecks::range(const DocumentPath& where, const FieldRange& range, double value) {
  const FieldRange::Kind kind = range.kind;
  if (kind == FieldRange::interval) return checks_.within(where, value, range.least, range.most);
  if (kind == FieldRange::length) return checks_.length(where, value);
  if (kind == FieldRange::factor) return checks_.not_negative(where, value);
  if (kind == FieldRange::ratio) return checks_.ratio(where, value);
  const bool is_coordinate = kind == FieldRange::position || kind == FieldRange::length_or_0;
  const bool is_signed = kind == FieldRange::position || kind == FieldRange::any;
  return (is_coordinate ? checks_.coordinate(where, value) : checks_.finite(where, value)) &&
         (is_signed || checks_.at_least_0(where, value));
}

}  // namespace tracer
