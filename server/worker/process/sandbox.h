#pragma once
/// What the worker gives up before it reads anything that came from outside: whoever takes it over by a flaw in a
/// decoder or in the tracer can compute, speak to the daemon over the socket it has, and no more.
///
/// - no_new_privs, no core files, no message queues; it needs no capability, so containers may drop all.
/// - seccomp: an allow-list of system calls. No sockets, no programs, no processes (threads only), no code made at run
///   time, no files opened for writing. What is not on the list fails with EPERM, or ENOSYS where libraries then take
///   another way.
/// - Landlock (Linux 5.13), which is about files as seccomp cannot be: only what is below the given directories can be
/// read.
///   Without it what the daemon may read can be read, if there are directories at all; else nothing can be opened
///   anyhow.

#include <cstdint>
#include <string>
#include <vector>

namespace worker {

/// In two steps, for threads inherit the first and libraries load others until they are warm. Neither can be undone.
/// In a sanitizer's build neither does anything: its run-time needs what is taken.

/// The first, from the only thread: files. Libraries stay readable, wherever the system has them. False where there is
/// no Landlock. Throws std::system_error.
bool restrict_files(const std::vector<std::string>& readable_directories);

/// The second, for all threads: the rest. Throws std::system_error where there is no seccomp: a worker that cannot be
/// held does not work.
void restrict_calls(bool opens_files);

/// What a worker with so many jobs at once may have: files open, and memory. The daemon watches that of jobs, once a
/// second; this bound holds in between too, further off, and allocating beyond it fails. Throws std::system_error.
void limit_resources(int slots, std::uint64_t job_memory_bytes);

/// What the two came to, for people: "seccomp, landlock".
std::string sandbox_name(bool landlock);

}  // namespace worker
