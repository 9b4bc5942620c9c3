#pragma once
/// Canonical JSON text: equal for all spellings of the same value. As in RFC 8785, except that names are ordered by
/// their bytes and that -0.0 is kept.

#include <string>
#include <string_view>

#include "api/src/json/json_parser.h"

namespace api::json {

/// Canonical text of the tape's value without its member `omitted`. Both members of a duplicate name are written, in
/// their order. Recursion is as deep as the value, which DocumentLimits::depth bounds.
std::string canonical_text(Tape& tape, std::string_view omitted);

}  // namespace api::json
