#include "server/worker/process/sandbox.h"

#include <fcntl.h>
#include <linux/audit.h>
#include <linux/capability.h>
#include <linux/filter.h>
#include <linux/landlock.h>
#include <linux/prctl.h>
#include <linux/seccomp.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <system_error>
#include <utility>

#include "server/support/descriptor.h"

namespace worker {
#ifdef WHITTLE_SANITIZED

bool restrict_files(const std::vector<std::string>&) { return false; }
void limit_resources(int, std::uint64_t) {}
void restrict_calls() {}
std::string sandbox_name(bool) { return "none"; }

#else

namespace {

// ---- system calls

#if defined(__x86_64__)
constexpr std::uint32_t our_architecture = AUDIT_ARCH_X86_64;
#elif defined(__aarch64__)
constexpr std::uint32_t our_architecture = AUDIT_ARCH_AARCH64;
#else
#error "system call numbers of this architecture have not been checked"
#endif

/// Calls for threads, memory, clocks and open descriptors, with any arguments.
constexpr long always[] = {
    // memory
    SYS_brk, SYS_munmap, SYS_mremap, SYS_madvise,
    // threads and time
    SYS_futex, SYS_set_robust_list, SYS_rseq, SYS_sched_yield, SYS_getcpu, SYS_membarrier, SYS_nanosleep,
    SYS_clock_nanosleep, SYS_clock_gettime, SYS_clock_getres, SYS_gettimeofday, SYS_restart_syscall, SYS_exit,
    SYS_exit_group,
    // signals
    SYS_rt_sigaction, SYS_rt_sigprocmask, SYS_rt_sigreturn, SYS_sigaltstack,
    // identity and resources
    SYS_getpid, SYS_gettid, SYS_getrusage, SYS_sysinfo, SYS_uname, SYS_getrandom,
    // open descriptors and shared memory
    SYS_read, SYS_write, SYS_readv, SYS_writev, SYS_pread64, SYS_pwrite64, SYS_lseek, SYS_close, SYS_fstat,
    SYS_ftruncate, SYS_fallocate, SYS_memfd_create, SYS_sendmsg, SYS_recvmsg, SYS_ppoll,
#if defined(SYS_poll)
    SYS_poll
#endif
};

constexpr std::uint32_t offset_of_argument(int index) {
  return static_cast<std::uint32_t>(offsetof(seccomp_data, args)) + 8U * static_cast<std::uint32_t>(index);
}

/// Builds the program; between rules the number of the call is in the accumulator.
class Filter {
 public:
  Filter() {
    load(offsetof(seccomp_data, arch));
    code_.push_back(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, our_architecture, 1, 0));
    answer(SECCOMP_RET_KILL_PROCESS);  // numbers have another meaning
    load(offsetof(seccomp_data, nr));
  }

  void allow(long call) {
    skip_unless(call, 1);
    answer(SECCOMP_RET_ALLOW);
  }
  void refuse(long call, int error) {
    skip_unless(call, 1);
    answer(SECCOMP_RET_ERRNO | static_cast<std::uint32_t>(error));
  }
  /// Only if the lower half of the argument has none of these bits.
  void allow_without(long call, int argument, std::uint32_t bits) { compare(call, argument, BPF_JSET, bits, false); }
  void allow_with(long call, int argument, std::uint32_t bit) { compare(call, argument, BPF_JSET, bit, true); }
  /// Only if the lower half of the argument is one of `values`, at most 16; `error` otherwise.
  void allow_equal(long call, int argument, const std::vector<std::uint32_t>& values, int error = EPERM) {
    const auto count = static_cast<std::uint8_t>(values.size());
    skip_unless(call, static_cast<std::uint8_t>(count + 3));
    load(offset_of_argument(argument));
    for (std::uint8_t i = 0; i < count; ++i)
      code_.push_back(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, values[i], static_cast<std::uint8_t>(count - i), 0));
    answer(SECCOMP_RET_ERRNO | static_cast<std::uint32_t>(error));
    answer(SECCOMP_RET_ALLOW);
  }
  /// Only if both halves of the argument are 0: a null pointer.
  void allow_null(long call, int argument) {
    allow_zeros(call, offset_of_argument(argument), offset_of_argument(argument) + 4);
  }
  /// Only if the lower halves of both arguments are 0.
  void allow_zero(long call, int argument, int other) {
    allow_zeros(call, offset_of_argument(argument), offset_of_argument(other));
  }

  std::vector<sock_filter> finished() {
    answer(refused);
    return std::move(code_);
  }

 private:
  static constexpr std::uint32_t refused = SECCOMP_RET_ERRNO | EPERM;

  void allow_zeros(long call, std::size_t word, std::size_t other) {
    skip_unless(call, 6);
    load(word);
    code_.push_back(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, 0, 0, 3));
    load(other);
    code_.push_back(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, 0, 0, 1));
    answer(SECCOMP_RET_ALLOW);
    answer(refused);
  }

  void load(std::size_t offset) {
    code_.push_back(BPF_STMT(BPF_LD | BPF_W | BPF_ABS, static_cast<std::uint32_t>(offset)));
  }
  void answer(std::uint32_t action) { code_.push_back(BPF_STMT(BPF_RET | BPF_K, action)); }
  void skip_unless(long call, std::uint8_t skipped) {
    code_.push_back(BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, static_cast<std::uint32_t>(call), 0, skipped));
  }
  void compare(long call, int argument, std::uint16_t comparison, std::uint32_t value, bool wanted) {
    skip_unless(call, 4);
    load(offset_of_argument(argument));
    code_.push_back(BPF_JUMP(static_cast<std::uint16_t>(BPF_JMP | comparison | BPF_K), value,
                             static_cast<std::uint8_t>(wanted ? 0 : 1), static_cast<std::uint8_t>(wanted ? 1 : 0)));
    answer(SECCOMP_RET_ALLOW);
    answer(refused);
  }

  std::vector<sock_filter> code_;
};

/// The allow-list of restrict_calls as a seccomp(2) filter program.
std::vector<sock_filter> system_call_filter() {
  Filter filter;
  for (const long call : always) filter.allow(call);
  filter.allow_with(SYS_clone, 0, CLONE_THREAD);
  filter.refuse(SYS_clone3, ENOSYS);  // filters cannot read its arguments; libc then uses clone
  for (const long call : {SYS_mmap, SYS_mprotect}) filter.allow_without(call, 2, PROT_EXEC);
  filter.allow_equal(SYS_prctl, 0, {PR_SET_NAME});
  filter.allow_equal(SYS_tgkill, 0, {static_cast<std::uint32_t>(::getpid())});  // abort
  // No signals through descriptors that the daemon shares (F_SETOWN, F_SETSIG, F_SETFL with O_ASYNC), no leases.
  filter.allow_equal(SYS_fcntl, 1, {F_GETFD, F_SETFD, F_GETFL, F_DUPFD_CLOEXEC, F_ADD_SEALS, F_GET_SEALS});
  // The calling thread. libc reads that of others for their stacks and accepts ENOSYS.
  filter.allow_equal(SYS_sched_setaffinity, 0, {0});
  filter.allow_equal(SYS_sched_getaffinity, 0, {0}, ENOSYS);
  filter.allow_null(SYS_prlimit64, 2);  // reads a limit
  static_assert(PRIO_PROCESS == 0);
  filter.allow_zero(SYS_setpriority, 0, 1);  // the calling thread
  return filter.finished();
}

// ---- files and resources

[[noreturn]] void fail(const char* what) { throw std::system_error(errno, std::generic_category(), what); }

/// All access rights for files that Landlock of this kernel can restrict (linux/landlock.h: 13 in version 1, one more
/// in each of 2, 3 and 5).
std::uint64_t rights_of(long version) {
  const int count = version >= 5 ? 16 : version >= 3 ? 15 : version == 2 ? 14 : 13;
  return (std::uint64_t{1} << count) - 1;
}

/// Layout of landlock_ruleset_attr since version 6, which older headers do not have.
struct RulesetAttributes {
  std::uint64_t handled_access_fs = 0, handled_access_net = 0, scoped = 0;
};

RulesetAttributes attributes_of(long version) {
  RulesetAttributes attributes{rights_of(version)};
  if (version >= 4) attributes.handled_access_net = 3;  // TCP: bind, connect
  if (version >= 6) attributes.scoped = 3;              // abstract Unix sockets and signals of other processes
  return attributes;
}

/// Removes them from the calling thread for good: a daemon that was started as root passes its own on.
void drop_capabilities() {
  for (int capability = 0; ::prctl(PR_CAPBSET_READ, capability, 0, 0, 0) >= 0; ++capability) {
    if (::prctl(PR_CAPBSET_DROP, capability, 0, 0, 0) != 0 && errno != EPERM) fail("drop a capability");
  }
  __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
  __user_cap_data_struct none[_LINUX_CAPABILITY_U32S_3]{};
  if (syscall(SYS_capset, &header, none) != 0) fail("capset");
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
  drop_capabilities();
  const long version = syscall(SYS_landlock_create_ruleset, nullptr, 0, LANDLOCK_CREATE_RULESET_VERSION);
  if (version < 1) return false;
  const RulesetAttributes attributes = attributes_of(version);
  // Older kernels accept the larger structure as long as the rest is 0.
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
  lower(RLIMIT_FSIZE, job_memory_bytes);  // images, in memory that the limit of data does not count
  // A job has its document, its images and the file it reads. Threads are not limited: RLIMIT_NPROC counts those of
  // the user, and seccomp allows no other processes.
  lower(RLIMIT_NOFILE, 256 + 32 * jobs);
}

void restrict_calls() {
  for (const auto resource : {RLIMIT_CORE, RLIMIT_MSGQUEUE}) lower(resource, 0);
  if (::prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) fail("no_new_privs");
  std::vector<sock_filter> filter = system_call_filter();
  sock_fprog program{};
  program.len = static_cast<unsigned short>(filter.size());
  program.filter = filter.data();
  if (syscall(SYS_seccomp, SECCOMP_SET_MODE_FILTER, SECCOMP_FILTER_FLAG_TSYNC, &program) != 0) fail("seccomp");
}

std::string sandbox_name(bool landlock) { return landlock ? "seccomp, landlock" : "seccomp"; }

#endif

}  // namespace worker
