#pragma once
/// Work on finished images for clients that wait.

#include <cstdint>

#include "server/worker/protocol/protocol.h"

namespace worker {

/// Sends the result on the socket. Any thread; one task runs at a time, with about `memory_bytes` at most: images with
/// too many pixels for that are refused. Never throws.
void run_image_task(ImageTask task, std::uint64_t memory_bytes, int socket) noexcept;

}  // namespace worker
