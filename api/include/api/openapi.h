#pragma once
/// The HTTP contract for programs: api/openapi.yaml as JSON and as a page, built into the program.

#include <string_view>

namespace api {

/// Both live as long as the program.
std::string_view openapi_json();
std::string_view docs_html();

}  // namespace api
