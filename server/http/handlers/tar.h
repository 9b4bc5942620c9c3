#pragma once
/// A tar archive (POSIX.1-1988, ustar) of stored artifacts as the body of a reply. It is produced while it is sent, and
/// exists neither in memory nor on disk.

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "server/http/http_messages.h"
#include "server/queue/artifact_store.h"

namespace http::handlers {

struct TarEntry {
  std::string name;           ///< at most 100 bytes
  std::uint64_t bytes = 0;    ///< below 8 GiB, the limit of the format
  std::int64_t modified = 0;  ///< ms since 1970 UTC
  queue::Artifact artifact;
};

using OpenArtifact = std::function<std::unique_ptr<queue::ArtifactReader>(const queue::Artifact&)>;

/// Opens one artifact at a time. An artifact that is missing then cuts the reply short.
BodySource tar_of(std::vector<TarEntry> entries, OpenArtifact open);

}  // namespace http::handlers
