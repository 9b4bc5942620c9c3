#pragma once
/// Reads documents that are as they should be, in a fraction of the time of nlohmann-json: large ones are numbers, and
/// a mesh took longer to read than to trace.

#include <string_view>

#include "api/src/json/tape_writer.h"

namespace api::json {

/// False: there is something that is no JSON, over a limit, or a number beyond doubles. What is wrong is not told, and
/// what was written means nothing. Otherwise the tape is what nlohmann's parser gives, bit for bit. Precondition: no
/// byte is NUL.
bool read_quickly(std::string_view bytes, const DocumentLimits& limits, TapeWriter& writer);

}  // namespace api::json
