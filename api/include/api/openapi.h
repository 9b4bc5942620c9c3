#pragma once
/// The HTTP contract: api/openapi.yaml as JSON, the JSON schema of scene documents, and pages for people of
/// both; all built into the program.

#include <string_view>

namespace api {

/// All live as long as the program.
std::string_view openapi_json();
std::string_view scene_schema_json();
std::string_view docs_html();
std::string_view scene_docs_html();

}  // namespace api
