#pragma once
/// The HTTP contract: api/openapi.yaml as JSON, the JSON schema of scene documents, and a page for people with both;
/// all built into the program.

#include <string_view>

namespace api {

/// All live as long as the program.
std::string_view openapi_json();
std::string_view scene_schema_json();
std::string_view docs_html();

}  // namespace api
