#include "api/src/json/tape.h"

#include <utility>

#include "api/src/json/nlohmann_parser.h"
#include "api/src/json/simdjson_parser.h"

namespace api::json {

tracer::Result<Tape, Error> parse(std::string_view bytes, const DocumentLimits& limits) {
  if (std::optional<Tape> tape = parse_with_simdjson(bytes, limits)) return std::move(*tape);
  return parse_with_nlohmann(bytes, limits);
}

}  // namespace api::json
