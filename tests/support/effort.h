#pragma once
/// Number of cases of a randomized test. Counts are for a run of seconds.

#include <cstdint>
#include <cstdlib>

namespace effort {

/// `usual` cases; a twentieth under a sanitizer. Set in the environment, WHITTLE_QUICK gives
/// a tenth and WHITTLE_THOROUGH twenty times as many.
inline std::uint64_t cases(std::uint64_t usual) {
  if (std::getenv("WHITTLE_THOROUGH") != nullptr) return usual * 20;
#ifdef WHITTLE_SANITIZED
  return usual / 20 + 1;
#else
  return std::getenv("WHITTLE_QUICK") != nullptr ? usual / 10 + 1 : usual;
#endif
}

}  // namespace effort
