#pragma once
/// The system calls that rendering needs, as a program for the kernel to judge each call by (seccomp(2)).

#include <linux/filter.h>

#include <vector>

namespace worker {

/// `opens_files`: files may be opened, for reading.
std::vector<sock_filter> system_call_filter(bool opens_files);

}  // namespace worker
