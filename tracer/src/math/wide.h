#pragma once
/// Loops over the lanes of a packet that the compiler makes vector code of.

namespace tracer {

/// Lanes of a packet: one vector of floats, two of doubles, on the widest machines.
inline constexpr int lanes = 16;

}  // namespace tracer

/// Functions that such a loop must take in whole, or it becomes no vector code.
#define WHITTLE_INLINE inline __attribute__((always_inline))

/// Functions of such loops. One binary runs on any x86-64-v2 machine and is fast on the newest. No clone may contract
/// a*b+c (-ffp-contract=off), so all give the same bits. Sanitizers start too late for the resolvers that this needs.
#if defined(__GNUC__) && !defined(__clang__) && !defined(WHITTLE_SANITIZED)
#define WHITTLE_WIDE __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define WHITTLE_WIDE
#endif
