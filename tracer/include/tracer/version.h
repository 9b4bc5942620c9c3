#pragma once
/// Which program this is. Images are comparable byte for byte between equal builds only.

#include <string_view>

namespace tracer {

std::string_view version();  ///< "0.1.0"
std::string_view
build();  ///< "0.1.0+g1a2b3c4" (the commit it was built from, "-dirty" when changed), or "0.1.0" outside a checkout

}  // namespace tracer
