#pragma once
/// A tar archive (POSIX.1-1988, ustar) of stored artifacts as the body of a reply, read while it is sent: nothing of it
/// is ever whole in memory or on disk.

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "server/http/router.h"
#include "server/queue/artifact_store.h"

namespace http {

struct TarEntry {
  std::string name;           ///< at most 100 bytes
  std::uint64_t bytes = 0;    ///< below 8 GiB, which is what the format can say
  std::int64_t modified = 0;  ///< ms since 1970 UTC
  queue::Artifact artifact;
};

using OpenArtifact = std::function<std::unique_ptr<queue::ArtifactReader>(const queue::Artifact&)>;

/// One artifact is open at a time. An artifact that is gone when its turn comes cuts the reply short.
BodySource tar_of(std::vector<TarEntry> entries, OpenArtifact open);

}  // namespace http
