#pragma once
/// Functions that a loop over a packet's lanes must take in whole, or it becomes no vector code.

#define WHITTLE_INLINE inline __attribute__((always_inline))
