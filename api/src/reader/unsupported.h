#pragma once
/// What the scene format has and this build does not render. A line goes away when its feature is built.

#include <string_view>

namespace api {

/// Whether `name` is such a field of `scope` ("camera"), or such a word of a field ("camera.type").
bool is_unsupported(std::string_view scope, std::string_view name);

}  // namespace api
