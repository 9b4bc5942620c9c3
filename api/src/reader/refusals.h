#pragma once
/// The ways a document is refused, alike for every kind of document.

#include <string>
#include <string_view>
#include <vector>

#include "api/document.h"
#include "api/src/json/tape.h"

namespace api {

Refusal refusal_at(std::string_view bytes, json::Error error);
Refusal too_large(std::string detail);
Refusal too_many_bytes(std::size_t seen, std::size_t limit);
Refusal invalid(std::vector<tracer::Issue> issues);  ///< precondition: there are some

}  // namespace api
