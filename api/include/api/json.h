#pragma once
/// JSON values, from which replies and reports are written.

#include <cstddef>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tracer/validate.h"

namespace api {

using Json = nlohmann::ordered_json;

/// The text on one line with a newline at its end. Invalid UTF-8 is replaced by U+FFFD.
std::string json_line(const Json& json);

template <class Value>
Json or_null(const std::optional<Value>& value) {
  return value ? Json(*value) : Json(nullptr);
}
inline Json text_or_null(const std::string& text) { return text.empty() ? Json(nullptr) : Json(text); }

template <class List, class Write>
Json array_of(const List& list, const Write& write) {
  Json array = Json::array();
  for (const auto& each : list) array.push_back(write(each));
  return array;
}

/// An object with these members, whose names must differ. Unlike an initializer list of Json it makes no array of each
/// member first, and moves the values.
template <std::size_t count>
Json object_of(std::pair<const char*, Json> (&&members)[count]) {
  Json::object_t object;
  object.reserve(count);
  for (auto& [name, value] : members) object.emplace_back(name, std::move(value));
  return object;
}

/// [{pointer, code, detail}] with pointers as URI fragments.
Json issues_json(const std::vector<tracer::Issue>& issues);

}  // namespace api
