#include "server/queue/clock.h"

#include <sys/random.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <system_error>

namespace queue {
namespace {

constexpr std::uint64_t counter_end = 1u << 12;

std::string uuid_text(std::uint64_t high, std::uint64_t low) {
  constexpr std::string_view digits = "0123456789abcdef";
  std::string text;
  text.reserve(36);
  for (int nibble = 0; nibble < 32; ++nibble) {
    if (nibble == 8 || nibble == 12 || nibble == 16 || nibble == 20) text.push_back('-');
    const std::uint64_t half = nibble < 16 ? high : low;
    text.push_back(digits[half >> (60 - 4 * (nibble % 16)) & 0xf]);
  }
  return text;
}

}  // namespace

Clock system_clock() {
  return [] {
    const auto now = std::chrono::system_clock::now().time_since_epoch();
    return std::chrono::duration_cast<std::chrono::milliseconds>(now).count();
  };
}

RandomBits system_random() {
  return [] {
    std::uint64_t bits = 0;
    while (getrandom(&bits, sizeof bits, 0) != static_cast<ssize_t>(sizeof bits)) {
      if (errno != EINTR) throw std::system_error(errno, std::generic_category(), "getrandom");
    }
    return bits;
  };
}

std::string IdSource::next() {
  const std::lock_guard lock(mutex_);
  const auto now = static_cast<std::uint64_t>(std::max<std::int64_t>(clock_(), 0));
  if (now > millisecond_) {
    millisecond_ = now;
    counter_ = random_() % (counter_end / 2);  // the upper half is room to count
  } else if (++counter_ == counter_end) {
    ++millisecond_;
    counter_ = 0;
  }
  constexpr std::uint64_t version = 7, variant = 0b10;
  return uuid_text(millisecond_ << 16 | version << 12 | counter_, variant << 62 | random_() >> 2);
}

}  // namespace queue
