/// shifted_clock.so, for LD_PRELOAD: a wall clock that is $SHIFTED_CLOCK_S seconds ahead.

#include <dlfcn.h>

#include <cstdlib>
#include <ctime>

extern "C" int clock_gettime(clockid_t clock, timespec* time) noexcept {
  using Call = int (*)(clockid_t, timespec*);
  static const auto real = reinterpret_cast<Call>(dlsym(RTLD_NEXT, "clock_gettime"));
  static const long ahead_s = std::strtol(std::getenv("SHIFTED_CLOCK_S"), nullptr, 10);
  const int result = real(clock, time);
  if (clock == CLOCK_REALTIME) time->tv_sec += ahead_s;
  return result;
}
