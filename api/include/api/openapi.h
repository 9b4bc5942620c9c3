#pragma once
/// The machine contract of the HTTP service: api/openapi.yaml as JSON and as a page, built into the program.

#include <string_view>

namespace api {

std::string_view openapi_json();  ///< lives as long as the program
std::string_view docs_html();     ///< likewise: the same for people

}  // namespace api
