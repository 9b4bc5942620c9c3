#pragma once
/// Puts issues where a reader of the document meets them.

#include <vector>

#include "api/src/json/tape.h"
#include "tracer/validate.h"

namespace api {

/// Sorts by the place in the document that each pointer names; what does not exist (a missing field) is put at what
/// would hold it. Issues of one place keep their order. Time linear in the document, whatever the number of issues.
/// Pointers begin at `root`.
void sort_by_position(std::vector<tracer::Issue>& issues, json::Tape& tape, json::Node* root);
inline void sort_by_position(std::vector<tracer::Issue>& issues, json::Tape& tape) {
  sort_by_position(issues, tape, tape.root());
}

}  // namespace api
