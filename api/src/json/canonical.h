#pragma once
/// One text for all spellings of the same JSON value, as RFC 8785 has it but for the order of names, which is that of
/// their bytes, and for -0, which stays.

#include <string>
#include <string_view>

#include "api/src/json/tape.h"

namespace api::json {

/// Of the tape's value without its member `omitted`. Depth is what the parser's limit lets through. Of a name written
/// twice both members stay, in their order.
std::string canonical_text(Tape& tape, std::string_view omitted);

}  // namespace api::json
