#pragma once
/// The memory of a process.

#include <unistd.h>

#include <cstdint>
#include <fstream>
#include <optional>
#include <string>

namespace support {

/// Resident bytes, from /proc; none if there is no such process.
inline std::optional<std::int64_t> resident_bytes(int pid) {
  std::ifstream statm("/proc/" + std::to_string(pid) + "/statm");
  std::int64_t pages = 0, resident_pages = 0;
  if (!(statm >> pages >> resident_pages)) return std::nullopt;
  return resident_pages * ::sysconf(_SC_PAGESIZE);
}

}  // namespace support
