#pragma once
/// Says everything that keeps a Scene from being rendered: ranges, degenerate shapes, dangling handles, limits.

#include <functional>
#include <string>
#include <vector>

#include "tracer/limits.h"
#include "tracer/scene.h"

namespace tracer {

/// One thing that is wrong.
struct Issue {
  std::string pointer;  ///< RFC 6901 from the document root, without '#': "/objects/3/radius"; "" is the whole document
  std::string code;  ///< stable, for programs: "out_of_range", "degenerate", "unknown_reference", "limit_exceeded", ...
  std::string detail;  ///< a sentence for people that names the rule and the value seen: "must be > 0, got -1"
  bool operator==(const Issue&) const = default;
};

/// All issues, in the order of Scene's members; empty when the scene can be rendered. Never fails; time linear in the
/// scene's size. At most 1000 are told, then one "too_many_issues" that gives the count of the rest.
/// Issues for which `known` is true are left out: a reader that has told why a number is missing or no number puts NaN
/// in its place, and leaves out what follows from that.
std::vector<Issue> validate(const Scene& scene, const Limits& limits,
                            const std::function<bool(const Issue&)>& known = {});

}  // namespace tracer
