#pragma once
/// Number of cases of a randomized test. Counts are for a default run of seconds.

#include <cstdint>
#include <cstdlib>

namespace effort {

/// `usual` cases; a twentieth under a sanitizer, twenty times as many if WHITTLE_THOROUGH is set in the environment.
inline std::uint64_t cases(std::uint64_t usual) {
  if (std::getenv("WHITTLE_THOROUGH") != nullptr) return usual * 20;
#ifdef WHITTLE_SANITIZED
  return usual / 20 + 1;
#else
  return usual;
#endif
}

}  // namespace effort
