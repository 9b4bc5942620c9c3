#pragma once
/// Document order of issues.

#include <vector>

#include "api/src/json/tape.h"
#include "tracer/validate.h"

namespace api {

/// Sorts issues by the position of the value that their pointers name, from `root`; a missing value has the position of
/// the object that should contain it. Issues at one position keep their order. Time is linear in the document for any
/// number of issues.
void sort_by_position(std::vector<tracer::Issue>& issues, json::Tape& tape, json::Node* root);

}  // namespace api
