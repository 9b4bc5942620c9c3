#pragma once
/// The allow-list of system calls that rendering needs, as a seccomp(2) filter program.

#include <linux/filter.h>

#include <vector>

namespace worker {

/// `opens_files`: files may be opened for reading.
std::vector<sock_filter> system_call_filter(bool opens_files);

}  // namespace worker
