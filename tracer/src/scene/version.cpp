#include "tracer/version.h"

namespace tracer {

std::string_view version() { return WHITTLE_VERSION; }
std::string_view build() { return WHITTLE_BUILD; }

}  // namespace tracer
