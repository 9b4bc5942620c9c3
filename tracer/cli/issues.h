#pragma once
/// What is wrong with a scene, as lines for people and for `cut`.

#include <cstdio>
#include <string>
#include <string_view>

#include "api/document.h"

namespace cli {

/// One line an issue: pointer, code, sentence, with one space between: "#/objects/3/radius out_of_range must be > 0,
/// got -1". A document that is no JSON is told with line and column instead of a pointer. Control characters that the
/// document smuggled in are shown as \xNN (%NN in a pointer): an issue stays one line and no terminal obeys it.
void print_issue(std::FILE* into, const tracer::Issue& issue);
void print_issues(std::FILE* into, const api::Refusal& refusal);

/// "#/materials/my%20red": a pointer as a URI fragment (RFC 6901, section 6), so it holds no space.
std::string fragment(std::string_view pointer);

}  // namespace cli
