#pragma once
/// Names of fields and types in other programs (POV-Ray, pbrt, three.js, Blender, MTL files), and the form here.

#include <string_view>

namespace api {

/// The form that replaces `word`; empty if the word is not listed. `scope` is the kind of object that has the word
/// as a field ("a material"), or "type" for the value of a field `type`. Case, '_' and '-' are ignored.
std::string_view form_of_foreign_word(std::string_view scope, std::string_view word);

}  // namespace api
