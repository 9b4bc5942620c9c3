#pragma once
/// Vectorized loops over the lanes of a packet.

namespace tracer {

/// Lanes of a packet: one vector of floats, two of doubles, on the widest machines.
inline constexpr int lanes = 16;

}  // namespace tracer

/// Marks functions that must be inlined into such a loop to vectorize it.
#define WHITTLE_INLINE inline __attribute__((always_inline))

/// Marks functions with such loops: one clone per instruction set is compiled and selected at load time. The binary
/// runs on any x86-64-v2 machine. No clone may contract a*b+c (-ffp-contract=off), so all are bit-identical. Disabled
/// with sanitizers, which start after the resolvers run.
#if defined(__GNUC__) && !defined(__clang__) && !defined(WHITTLE_SANITIZED)
#define WHITTLE_WIDE __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define WHITTLE_WIDE
#endif
