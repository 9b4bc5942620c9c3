#pragma once
/// Version of the program. Images are comparable byte for byte between equal builds only.

#include <string_view>

namespace tracer {

std::string_view version();  ///< "0.1.0"
/// Version and git commit, "0.1.0+g1a2b3c4", with "-dirty" for a modified checkout; "0.1.0" outside of a checkout.
std::string_view build();

}  // namespace tracer
