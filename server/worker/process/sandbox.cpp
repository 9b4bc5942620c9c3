#include "server/worker/process/sandbox.h"

#include <fcntl.h>
#include <linux/landlock.h>
#include <linux/seccomp.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <system_error>

#include "server/support/descriptor.h"

namespace worker {
#ifdef WHITTLE_SANITIZED

bool restrict_files(const std::vector<std::string>&) { return false; }
void limit_resources(int, std::uint64_t) {}
void restrict_calls(bool) {}
std::string sandbox_name(bool) { return "none"; }

#else

namespace {

[[noreturn]] void fail(const char* what) { throw std::system_error(errno, std::generic_category(), what); }

/// All access rights for files that Landlock of this kernel can restrict (linux/landlock.h: 13 in version 1, one more
/// in each of 2, 3 and 5).
std::uint64_t rights_of(long version) {
  const int count = version >= 5 ? 16 : version >= 3 ? 15 : version == 2 ? 14 : 13;
  return (std::uint64_t{1} << count) - 1;
}

void lower(decltype(RLIMIT_CORE) resource, rlim_t most) {
  rlimit limit{};
  if (::getrlimit(resource, &limit) != 0) fail("getrlimit");
  limit.rlim_max = std::min(limit.rlim_max, most);
  limit.rlim_cur = limit.rlim_max;
  if (::setrlimit(resource, &limit) != 0) fail("setrlimit");
}

void allow_reading_below(int ruleset, const std::string& directory) {
  const support::Descriptor opened(::open(directory.c_str(), O_PATH | O_CLOEXEC));
  if (!opened && errno == ENOENT) return;  // jobs without files can still run
  if (!opened) fail("the sandbox cannot open a directory of files");
  landlock_path_beneath_attr rule{};
  rule.allowed_access = LANDLOCK_ACCESS_FS_READ_FILE | LANDLOCK_ACCESS_FS_READ_DIR;
  rule.parent_fd = opened.get();
  if (syscall(SYS_landlock_add_rule, ruleset, LANDLOCK_RULE_PATH_BENEATH, &rule, 0) != 0) fail("landlock_add_rule");
}

}  // namespace

bool restrict_files(const std::vector<std::string>& readable_directories) {
  if (::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) fail("no_new_privs");
  const long version = syscall(SYS_landlock_create_ruleset, nullptr, 0, LANDLOCK_CREATE_RULESET_VERSION);
  if (version < 1) return false;
  landlock_ruleset_attr attributes{};
  attributes.handled_access_fs = rights_of(version);
  const support::Descriptor ruleset(
      static_cast<int>(syscall(SYS_landlock_create_ruleset, &attributes, sizeof attributes, 0)));
  if (!ruleset) return false;
  allow_reading_below(ruleset.get(), "/usr/lib");
  for (const std::string& directory : readable_directories) allow_reading_below(ruleset.get(), directory);
  if (syscall(SYS_landlock_restrict_self, ruleset.get(), 0) != 0) fail("landlock_restrict_self");
  return true;
}

void limit_resources(int slots, std::uint64_t job_memory_bytes) {
  const auto jobs = static_cast<std::uint64_t>(slots);
  // Half of the allocated memory may stay untouched; 2 GiB are for stacks and libraries.
  constexpr std::uint64_t base_bytes = 2ull << 30;
  const bool too_many = job_memory_bytes > (UINT64_MAX / 2 - base_bytes) / (2 * jobs);
  const std::uint64_t bytes = too_many ? UINT64_MAX / 2 : base_bytes + 2 * jobs * job_memory_bytes;
  lower(RLIMIT_DATA, bytes);
  // A job has its document, its images and the file it reads. Threads are not limited: RLIMIT_NPROC counts those of
  // the user, and seccomp allows no other processes.
  lower(RLIMIT_NOFILE, 256 + 32 * jobs);
}

void restrict_calls(bool opens_files) {
  for (const auto resource : {RLIMIT_CORE, RLIMIT_MSGQUEUE}) lower(resource, 0);
  if (::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) fail("no_new_privs");
  std::vector<sock_filter> filter = system_call_filter(opens_files);
  sock_fprog program{};
  program.len = static_cast<unsigned short>(filter.size());
  program.filter = filter.data();
  if (syscall(SYS_seccomp, SECCOMP_SET_MODE_FILTER, SECCOMP_FILTER_FLAG_TSYNC, &program) != 0) fail("seccomp");
}

std::string sandbox_name(bool landlock) { return landlock ? "seccomp, landlock" : "seccomp"; }

#endif

}  // namespace worker
