#pragma once
/// Parses JSON text with limits, by the SAX interface of nlohmann-json.

#include <string>
#include <string_view>

#include "api/document.h"
#include "api/src/json/tape.h"
#include "tracer/result.h"

namespace api::json {

struct Error {
  bool limit = false;      ///< a DocumentLimits bound is exceeded; otherwise the text is not JSON
  std::size_t offset = 0;  ///< byte at which the error was found
  std::string detail;
};

/// Strings are valid UTF-8 without lone surrogates; a leading byte order mark is skipped. Duplicate keys are kept for
/// the reader to report. A number too large for a double is infinite; more than 16 of them are an error. Time is
/// linear in `bytes`; memory is at most 16 bytes for each value and key kept plus three for each byte of the document.
tracer::Result<Tape, Error> parse(std::string_view bytes, const DocumentLimits& limits);

}  // namespace api::json
