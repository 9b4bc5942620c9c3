#pragma once
/// Free space of the disk for jobs, images and uploads.

#include <cstdint>
#include <functional>
#include <string>

namespace queue {

struct DiskSpace {
  enum class State {
    enough,
    scarce,  ///< below the reserve: no submission is accepted, accepted jobs run and end
    none,    ///< also no job is claimed; running ones may end
  };
  State state = State::enough;
  std::uint64_t free_bytes = 0;
  std::uint64_t reserve_bytes = 0;  ///< kept for accepted jobs
};

using DiskSpaceProbe = std::function<DiskSpace()>;  ///< any thread; returns at once; must not throw

/// For operators and clients, of a state other than `enough`.
inline std::string describe(const DiskSpace& space) {
  return std::to_string(space.free_bytes) + " bytes are free on the disk, " + std::to_string(space.reserve_bytes) +
         " are kept for jobs that were accepted before";
}

}  // namespace queue
