#pragma once
/// The directory below which scenes' files lie: nothing outside it can be reached through it, whatever the name.

#include <cstdint>
#include <string>

#include "api/load_assets.h"
#include "server/worker/protocol/sealed_memory.h"

namespace worker {

/// Names are relative to the directory, as api::Files::below_a_directory lets them through; the kernel holds them to it
/// all the same (openat2 with RESOLVE_BENEATH): "..", absolute names and symbolic links lead nowhere outside. Links
/// that stay within are followed. Thread-safe.
class AssetDirectory {
 public:
  /// Throws std::system_error when there is no such directory, or the kernel has no openat2 (Linux 5.6).
  explicit AssetDirectory(const std::string& path);

  // Both throw std::system_error where a file cannot be opened for this process's sake: descriptors, memory.

  /// Empty where `name` is an ordinary file of at most api::asset_bytes_max bytes, else the end of a sentence that
  /// says what it is instead. Opens nothing for reading.
  [[nodiscard]] std::string refusal(const std::string& name) const;

  /// The content, under the same conditions. Neither pipes nor devices keep it waiting.
  [[nodiscard]] api::AssetBytes read(const std::string& name) const;

  /// Changes whenever the file's content does: which file it is, its size, and when it was last changed. Empty where
  /// that is no two seconds ago, for the clock of files is coarse and it may change again within one tick; and where
  /// `refusal` would say something. Opens nothing for reading.
  [[nodiscard]] std::string stamp(const std::string& name) const;

 private:
  Descriptor directory_;
};

}  // namespace worker
