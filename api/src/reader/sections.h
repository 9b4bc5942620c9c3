#pragma once
/// The sections of a scene document: one function for each, and the readers of the values that they share. Readers of
/// values return as those in field_values.h. The order of sections matters for the resolution of names: textures,
/// materials, prototypes, objects.

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "api/reader/cursor.h"
#include "api/reader/issue_text.h"
#include "tracer/result.h"

namespace api {

class Fields;

/// The scene document at `root`, which may be part of a larger one. Pointers begin at `root`; issues are in its order.
tracer::Result<Document, std::vector<tracer::Issue>> read_scene(json::Tape& tape, json::Node* root,
                                                                const Limits& limits);

void read_camera(Reading& reading, const Cursor& at);
void read_background(Reading& reading, const Cursor& at);
/// Without the section: the standard accuracy.
void read_accuracy(Reading& reading, const std::optional<Cursor>& at);
void read_lights(Reading& reading, const Cursor& at);
/// Adds an object for each visible light, after those of the document. Precondition: the scene is valid.
void add_visible_lights(Reading& reading);
void read_textures(Reading& reading, const Cursor& at);
void read_materials(Reading& reading, const Cursor& at);
void read_prototypes(Reading& reading, const Cursor& at);
void read_objects(Reading& reading, const Cursor& at);

/// A file's name as one of the scene's assets, of which there is one for each name.
bool read(Reading& reading, const Cursor& at, tracer::AssetId& asset);
/// [x0, y0, x1, y1]; unset if it is invalid.
bool read(Reading& reading, const Cursor& at, std::optional<tracer::PixelWindow>& window);
bool read(Reading& reading, const Cursor& at, tracer::Approximations& approximate);
bool read(Reading& reading, const Cursor& at, JobRequest& job);
bool read(Reading& reading, const Cursor& at, std::map<std::string, std::string>& labels);
/// A 4 x 4 matrix, or a list of steps applied in the order written.
bool read(Reading& reading, const Cursor& at, tracer::Transform& transform);
/// One number for all three axes, or one for each.
bool read_per_axis(Reading& reading, const Cursor& at, tracer::Vec3& value);
/// `transform`, or the short form of three steps: `scale`, then `rotate`, then `position`. The transform stays unset if
/// there is none of them.
void read_placement(Reading& reading, Fields& fields, std::optional<tracer::Transform>& transform);
/// The transform that applies `first`, then `then`.
tracer::Transform composed(const tracer::Transform& then, const tracer::Transform& first);
/// A name, of a prototype; or of a texture or a material, which may also be written in place.
bool read(Reading& reading, const Cursor& at, tracer::PrototypeId& prototype);
bool read(Reading& reading, const Cursor& at, tracer::TextureId& texture);
bool read(Reading& reading, const Cursor& at, tracer::MaterialId& material);
bool read(Reading& reading, const Cursor& at, tracer::ColorOrTexture& value);

// ---- Named textures and materials, which may also be written in place, and references to names.

/// False if `count` textures or materials are as many as the limit allows; the first time, an issue is added. Those
/// above the limit are not read, which bounds the memory.
inline bool has_capacity(Reading& reading, const Cursor& at, std::size_t count, std::string_view limit,
                         std::uint64_t bound) {
  if (count < bound) return true;
  if (reading.full.insert(limit).second)
    add_issue(reading, at, "limit_exceeded",
              "the limit " + std::string(limit) + " is " + std::to_string(bound) + ", those written in place included");
  return false;
}

/// Adds the value of each member, as `add` reads it, under its name. A duplicate name is an issue, and its member is
/// not read. Returns false, with an issue that names the form `expected`, if the value is not an object.
template <class Values, class Value>
bool read_names(Reading& reading, const Cursor& at, Values& values, Value (*add)(Reading&, const Cursor&),
                std::string_view expected = R"(an object of definitions by name: {"NAME": ...})") {
  const auto read_member = [&](const Cursor& member) {
    const auto [place, is_new] = values.emplace(member.key, Value{});
    if (is_new) {
      place->second = add(reading, member);
    } else {
      add_issue(reading, member, "duplicate_key", quoted(member.key) + " is defined twice");
    }
  };
  return for_each_member(reading, at, read_member, expected);
}

template <class Id>
bool add_unknown_reference(Reading& reading, const Cursor& at, const Names<Id>& names, std::string_view kind) {
  if (!reading.can_add_issue()) return false;
  std::vector<std::string_view> candidates;
  for (const auto& [name, id] : names.ids) {
    if (candidates.size() == suggestion_names_max) break;
    candidates.push_back(name);
  }
  std::string detail = quoted(at.node->string()) + " is not defined";
  const std::string meant = did_you_mean(at.node->string(), candidates);
  if (candidates.empty()) {
    detail.append(": define it in \"").append(kind).append("\": {").append(quoted(at.node->string())).append(": ...}");
  } else if (meant.empty()) {
    detail += "; defined are " + list_of(std::span(candidates).first(std::min<std::size_t>(candidates.size(), 20)));
  }
  detail += meant;
  reading.issues.push_back({pointer(at), "unknown_reference", std::move(detail)});
  return false;
}

/// Stores the identifier that the string at `at` names; adds an issue and returns false if there is none. `kind` is the
/// plural noun in the message.
template <class Id>
bool find_name(Reading& reading, const Cursor& at, const Names<Id>& names, std::string_view kind, Id& id) {
  const auto found = names.ids.find(at.node->string());
  if (found == names.ids.end()) return names.complete && add_unknown_reference(reading, at, names, kind);
  id = found->second;
  return true;
}

}  // namespace api
