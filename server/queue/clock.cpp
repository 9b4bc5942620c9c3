#include "server/queue/clock.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <system_error>

namespace queue {
namespace {

constexpr std::uint64_t counter_end = 1u << 12;

std::string uuid_text(std::uint64_t high, std::uint64_t low) {
  std::array<char, 37> text{};
  std::snprintf(text.data(), text.size(), "%08lx-%04lx-%04lx-%04lx-%012lx", high >> 32, high >> 16 & 0xffff,
                high & 0xffff, low >> 48, low & 0xffff'ffff'ffff);
  return text.data();
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
    if (::getentropy(&bits, sizeof bits) != 0) throw std::system_error(errno, std::generic_category(), "getentropy");
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
