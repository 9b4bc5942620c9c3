#pragma once
/// Work on finished images for clients that wait.

#include "server/worker/protocol/protocol.h"

namespace worker {

/// Sends the result on the socket. Any thread; one task runs at a time. Never throws.
void run_image_task(ImageTask task, int socket) noexcept;

}  // namespace worker
