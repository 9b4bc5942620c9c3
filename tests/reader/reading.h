#pragma once
/// Helpers of the reader's tests: documents with given members, issues as lines of text, the tables of invalid
/// documents.

#include <string>
#include <string_view>
#include <vector>

#include "api/document.h"

namespace reader_tests {

/// A document with a camera and `members` ("\"name\": \"x\"").
std::string document_with(std::string_view members = {});

/// A document with one object, given as its members without type and material.
std::string document_with_object(std::string_view type, std::string_view members);

/// The document read from `text`; fails the test and returns an empty one if it is rejected.
api::Document accepted(const std::string& text);

/// "/camera/fov out_of_range" for each issue, in order; fails the test if one has no sentence.
std::vector<std::string> issue_lines(const std::vector<tracer::Issue>& issues);

/// issue_lines() the warnings of a document that is accepted.
std::vector<std::string> warnings_of(const std::string& text);

/// issue_lines() the issues; "not_json 1:5", "too_large"; "accepted".
std::vector<std::string> outcome(std::string_view text, const api::Limits& limits = {});

/// The detail of the only issue, or of the error of a text that is not read; fails the test if there are more issues.
std::string only_detail(const std::string& text);

std::string file_bytes(const std::string& path);

struct InvalidDocument {
  std::string name;                  ///< TABLE.NAME
  std::string request;               ///< "scene", "batch" or "measure"
  std::string detail;                ///< as only_detail() gives it, or empty
  std::string text;                  ///< bytes, not always UTF-8
  std::vector<std::string> outcome;  ///< as outcome() gives it; or "warnings", then as warnings_of() gives them
};

/// outcome() of the text as the request that it is.
std::vector<std::string> outcome(const InvalidDocument& document);

/// All cases of tests/reader/invalid and, named TABLE.base, the valid documents that they patch.
std::vector<InvalidDocument> invalid_documents();

}  // namespace reader_tests
