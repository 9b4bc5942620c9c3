#pragma once
/// The scene document as a part of a larger one. Private to the reader.

#include <vector>

#include "api/document.h"
#include "api/src/json/tape.h"
#include "tracer/result.h"

namespace api {

/// What parse_scene says of the value at `root`. Pointers begin there; issues are in its order.
tracer::Result<Document, std::vector<tracer::Issue>> read_scene(json::Tape& tape, json::Node* root,
                                                                const Limits& limits);

}  // namespace api
