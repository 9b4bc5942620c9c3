#pragma once
/// Growth of the process's resident memory, whatever other tests have used before.

#include <fstream>
#include <string>

/// Resets the kernel's record of the largest resident memory (proc_pid_clear_refs(5)), where that is permitted; a
/// growth up to the earlier record is not found elsewhere.
class MemoryGrowth {
 public:
  MemoryGrowth() {
    std::ofstream("/proc/self/clear_refs") << "5";
    before_ = status_kib("VmHWM:");
  }

  /// Largest since the construction, in KiB.
  [[nodiscard]] long kibibytes() const { return status_kib("VmHWM:") - before_; }

 private:
  static long status_kib(const std::string& name) {
    std::ifstream status("/proc/self/status");
    std::string word;
    while (status >> word && word != name) {
    }
    long value = 0;
    status >> value;
    return value;
  }

  long before_ = 0;
};
