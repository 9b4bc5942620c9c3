#pragma once
/// Finds everything that prevents a Scene from being rendered: ranges, degenerate shapes, dangling handles, limits.

#include <functional>
#include <string>
#include <vector>

#include "tracer/limits.h"
#include "tracer/scene.h"

namespace tracer {

/// One violated rule.
struct Issue {
  std::string pointer;  ///< RFC 6901 from the document root, without '#': "/objects/3/radius"; "" is the whole document
  std::string code;     ///< stable, for programs: "out_of_range", "degenerate", "unknown_reference", ...
  std::string detail;   ///< a sentence for people with the rule and the value found: "must be > 0, got -1"
  bool operator==(const Issue&) const = default;
};

/// All issues, in the order of Scene's members; empty if the scene can be rendered. Never fails; time linear in the
/// scene's size. Returns at most 1000 issues, then one "too_many_issues" with the number of the rest. Omits issues for
/// which `is_reported` returns true: a reader that has reported a missing or malformed number stores NaN, and filters
/// out the issues that this NaN causes.
std::vector<Issue> validate(const Scene& scene, const Limits& limits,
                            const std::function<bool(const Issue&)>& is_reported = {});

/// The number in a sentence, with at most `digits` significant digits; 0: the shortest text that reads back as the same
/// number.
std::string text_of(double value, int digits = 0);

}  // namespace tracer
