#pragma once
/// Watches how full the disk is on which the data folder lies, and keeps a ballast there: a file of no use but that
/// giving it up makes room. On a disk that is really full not even deleting works, for that is a write to the database.
///
///   jobs::DiskRoom disk(folder, settings, log);    // before the stores: they need room to open
///   queue.watch_room([&] { return disk.now(); });
///   ... every half a second: if (disk.look()) queue.room_came();

#include <cstdint>
#include <mutex>
#include <string>

#include "server/jobs/log.h"
#include "server/jobs/room.h"

namespace jobs {

struct DiskRoomSettings {
  /// Below this nothing new is accepted; a tenth of the disk where that is less. 10 GiB are a thousand large pictures.
  std::uint64_t reserve_bytes = 10ull << 30;
  /// Room for the rows and the pictures of what runs when the disk is full; a 32nd of the disk where that is less.
  std::uint64_t ballast_bytes = 64ull << 20;
};

/// Thread-safe.
class DiskRoom {
 public:
  /// Makes `folder` where missing. Looks at once: takes the ballast, or gives up one that is there.
  DiskRoom(const std::string& folder, const DiskRoomSettings& settings, Log log);

  /// Looks at the disk. With less than a quarter of the ballast free that is given up, and with twice of it taken
  /// again. True when there was no room before and is now. Throws StoreFailure where the disk cannot be looked at.
  bool look();

  [[nodiscard]] Room now() const;  ///< as it was at the last look

 private:
  [[nodiscard]] bool has_ballast() const;
  bool take_ballast(std::uint64_t bytes);

  const std::string folder_, ballast_;
  const DiskRoomSettings settings_;
  const Log log_;
  mutable std::mutex mutex_;
  Room room_;
};

}  // namespace jobs
