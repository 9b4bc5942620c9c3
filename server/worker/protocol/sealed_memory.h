#pragma once
/// Sealed anonymous memory (memfd_create(2)), in which large data passes between processes without a copy.

#include <string_view>

#include "server/support/descriptor.h"

namespace worker {

using support::Descriptor;

/// Immutable memory with these bytes. Throws std::system_error.
Descriptor sealed_memory(std::string_view bytes);

/// True if no process can write, grow or shrink the memory any more, so that reading it is safe.
bool is_sealed(int fd);

}  // namespace worker
