#pragma once
/// The room that the disk has for jobs, images and uploads, as the queue sees it.

#include <cstdint>
#include <functional>
#include <string>

namespace queue {

struct DiskSpace {
  enum class State {
    enough,
    scarce,  ///< below the reserve: nothing new is accepted, what was accepted runs and ends
    none,    ///< and nothing is begun: what runs may still end
  };
  State state = State::enough;
  std::uint64_t free_bytes = 0;
  std::uint64_t reserve_bytes = 0;  ///< kept for what was accepted
};

using DiskSpaceProbe = std::function<DiskSpace()>;  ///< any thread; at once; must not throw

/// For operators and clients alike; of a room that is not enough.
inline std::string describe(const DiskSpace& room) {
  return std::to_string(room.free_bytes) + " bytes are free on the disk, " + std::to_string(room.reserve_bytes) +
         " are kept for jobs that were accepted before";
}

}  // namespace queue
