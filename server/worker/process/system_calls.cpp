#include <fcntl.h>
#include <linux/audit.h>
#include <linux/prctl.h>
#include <linux/seccomp.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <cerrno>
#include <cstddef>
#include <cstdint>

#include "server/worker/process/sandbox.h"

namespace worker {
namespace {

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
    SYS_futex, SYS_set_robust_list, SYS_rseq, SYS_sched_yield, SYS_sched_getaffinity, SYS_sched_setaffinity, SYS_getcpu,
    SYS_membarrier, SYS_nanosleep, SYS_clock_nanosleep, SYS_clock_gettime, SYS_clock_getres, SYS_gettimeofday,
    SYS_restart_syscall, SYS_exit, SYS_exit_group,
    // signals
    SYS_rt_sigaction, SYS_rt_sigprocmask, SYS_rt_sigreturn, SYS_sigaltstack,
    // identity and resources
    SYS_getpid, SYS_gettid, SYS_getrusage, SYS_sysinfo, SYS_uname, SYS_getrandom,
    // open descriptors and shared memory
    SYS_read, SYS_write, SYS_readv, SYS_writev, SYS_pread64, SYS_pwrite64, SYS_lseek, SYS_close, SYS_fstat,
    SYS_newfstatat, SYS_fcntl, SYS_ftruncate, SYS_fallocate, SYS_memfd_create, SYS_sendmsg, SYS_recvmsg, SYS_ppoll,
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
  void allow_equal(long call, int argument, std::uint32_t value) { compare(call, argument, BPF_JEQ, value, true); }
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

}  // namespace

std::vector<sock_filter> system_call_filter(bool opens_files) {
  Filter filter;
  for (const long call : always) filter.allow(call);
  filter.allow_with(SYS_clone, 0, CLONE_THREAD);
  filter.refuse(SYS_clone3, ENOSYS);  // filters cannot read its arguments; libc then uses clone
  for (const long call : {SYS_mmap, SYS_mprotect}) filter.allow_without(call, 2, PROT_EXEC);
  filter.allow_equal(SYS_prctl, 0, PR_SET_NAME);
  filter.allow_equal(SYS_tgkill, 0, static_cast<std::uint32_t>(::getpid()));  // abort
  filter.allow_null(SYS_prlimit64, 2);                                        // reads a limit
  static_assert(PRIO_PROCESS == 0);
  filter.allow_zero(SYS_setpriority, 0, 1);  // the calling thread
  if (opens_files) {
    filter.allow_without(SYS_openat, 2, O_WRONLY | O_RDWR | O_CREAT | O_TRUNC);
    filter.allow(SYS_openat2);
  }
  return filter.finished();
}

}  // namespace worker
