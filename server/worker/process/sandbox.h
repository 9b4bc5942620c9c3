#pragma once
/// Restricts the worker before it reads untrusted input: code that exploits a flaw in a decoder or in the tracer can
/// compute and use the sockets to the daemon, but nothing else.
///
/// - no_new_privs, no capabilities, no core files, no message queues.
/// - seccomp: an allow-list of system calls. No sockets, no programs, no processes (threads only), no code made at run
///   time, no files opened or looked up by name, no signals through descriptors, no scheduling of other processes.
///   Other calls fail with EPERM, or with ENOSYS if libraries then use an alternative.
/// - Landlock (Linux 5.13), a second barrier in case the first has a hole: no signals to other processes (Linux 6.12),
///   and only files below the given directories are readable.

#include <cstdint>
#include <string>
#include <vector>

namespace worker {

/// There are two steps, because threads inherit the first and libraries load others until they are warm. Neither can be
/// undone. In a sanitizer build neither does anything, because its runtime needs what is restricted.

/// First step, called while there is one thread: capabilities, files, signals. Libraries stay readable. False without
/// Landlock. Throws std::system_error.
bool restrict_files(const std::vector<std::string>& readable_directories);

/// Second step, for all threads: system calls. Throws std::system_error without seccomp: the worker does not run
/// unrestricted.
void restrict_calls();

/// Limits open files, their size and memory for this number of concurrent jobs. The daemon checks the memory of jobs
/// once a second; this higher limit holds at any time, and allocations beyond it fail. Throws std::system_error.
void limit_resources(int slots, std::uint64_t job_memory_bytes);

/// Name of the restrictions for logs: "seccomp, landlock".
std::string sandbox_name(bool landlock);

}  // namespace worker
