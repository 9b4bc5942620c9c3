#pragma once
/// The check of every fuzz target.

#include <cstdio>
#include <cstdlib>

/// Ends the program, which libFuzzer reports as a crash, if the promise is broken.
inline void require(bool promise, const char* what) {
  if (promise) return;
  std::fprintf(stderr, "broken promise: %s\n", what);
  std::abort();
}
