#pragma once
/// What the reader's tests share: documents around one part, and issues as lines of text.

#include <string>
#include <string_view>
#include <vector>

#include "api/document.h"

namespace reader_tests {

/// A document with a camera and `members` ("\"name\": \"x\"").
std::string document_with(std::string_view members = {});

/// A document with one object in it, given as its members but for type and material.
std::string document_with_object(std::string_view type, std::string_view members);

/// The document of `text`; fails the test and returns an empty one when it is refused.
api::Document accepted(const std::string& text);

/// "/camera/fov out_of_range" for each issue, in order; "not_json 1:5", "too_large"; "accepted".
std::vector<std::string> outcome(std::string_view text, const api::Limits& limits = {});

/// The sentence of the only issue; fails the test when there is not exactly one.
std::string only_detail(const std::string& text);

std::string file_bytes(const std::string& path);

}  // namespace reader_tests
