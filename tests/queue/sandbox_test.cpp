/// The restrictions of a compromised worker. Each attempt is made by a child process.

#include "server/worker/process/sandbox.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <linux/capability.h>
#include <linux/landlock.h>
#include <linux/openat2.h>
#include <pthread.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/ptrace.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <csignal>
#include <fstream>
#include <functional>
#include <future>
#include <thread>

#include "tests/conformance/temporary_directory.h"

#ifndef WHITTLE_SANITIZED

namespace {

/// The result of an attempt: 0 or errno.
using Attempt = std::function<int()>;

int error_of(long result) { return result < 0 ? errno : 0; }

constexpr int could_not_enter = 255;

/// The end of a child that makes the attempt; its exit status is the result.
int status_of(const Attempt& attempt) {
  const pid_t child = fork();
  if (child == 0) {
    try {
      _exit(attempt());
    } catch (...) {
      _exit(could_not_enter);
    }
  }
  int status = 0;
  waitpid(child, &status, 0);
  return status;
}

int result_of(const Attempt& attempt) {
  const int status = status_of(attempt);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

void enter_sandbox(const std::vector<std::string>& directories = {}) {
  worker::restrict_files(directories);
  worker::restrict_calls();
}

long landlock_version() { return syscall(SYS_landlock_create_ruleset, nullptr, 0, LANDLOCK_CREATE_RULESET_VERSION); }

long open_beneath_nothing(const std::string& path) {
  open_how how{};
  how.flags = O_RDONLY;
  return syscall(SYS_openat2, AT_FDCWD, path.c_str(), &how, sizeof how);
}

class SandboxTest : public testing::Test {
 protected:
  SandboxTest() {
    std::ofstream(inside) << "inside";
    std::ofstream(outside) << "outside";
  }
  /// The result of a system call in a sandbox that may read one directory.
  template <class Call>
  int error_of_call(const Call& call) {
    return result_of([&] {
      enter_sandbox({directory.path()});
      return error_of(call());
    });
  }
  TemporaryDirectory directory, other;
  std::string inside = directory.path() + "/file", outside = other.path() + "/file";
};

}  // namespace

TEST_F(SandboxTest, PreventsSockets) {
  for (const int family : {AF_INET, AF_INET6, AF_UNIX, AF_NETLINK}) {
    EXPECT_EQ(error_of_call([&] { return socket(family, SOCK_STREAM, 0); }), EPERM) << family;
  }
  EXPECT_EQ(error_of_call([] { return connect(0, nullptr, 0); }), EPERM);
  int pair[2];
  EXPECT_EQ(error_of_call([&] { return socketpair(AF_UNIX, SOCK_STREAM, 0, pair); }), EPERM);
}

TEST_F(SandboxTest, PreventsProgramsAndProcesses) {
  EXPECT_EQ(error_of_call([] { return execl("/bin/true", "true", nullptr); }), EPERM);
  EXPECT_EQ(error_of_call([] { return syscall(SYS_execveat, AT_FDCWD, "/bin/true", 0, 0, 0); }), EPERM);
  EXPECT_EQ(error_of_call([] { return fork(); }), EPERM);
#ifdef SYS_fork
  EXPECT_EQ(error_of_call([] { return syscall(SYS_fork); }), EPERM);
  EXPECT_EQ(error_of_call([] { return syscall(SYS_vfork); }), EPERM);
#endif
  EXPECT_EQ(error_of_call([] { return syscall(SYS_clone, SIGCHLD, 0, 0, 0, 0); }), EPERM);
  EXPECT_EQ(error_of_call([] { return syscall(SYS_clone3, nullptr, 0); }), ENOSYS);
}

TEST_F(SandboxTest, PreventsAccessToOtherProcesses) {
  const pid_t parent = getpid();
  EXPECT_EQ(error_of_call([&] { return kill(parent, 0); }), EPERM);
  EXPECT_EQ(error_of_call([&] { return syscall(SYS_tgkill, parent, parent, 0); }), EPERM);
  EXPECT_EQ(error_of_call([&] { return ptrace(PTRACE_ATTACH, parent, 0, 0); }), EPERM);
  const rlimit limit{1, 1};
  EXPECT_EQ(error_of_call([&] { return prlimit(parent, RLIMIT_NOFILE, &limit, nullptr); }), EPERM);
}

TEST_F(SandboxTest, PreventsSignalsThroughDescriptors) {
  int pair[2];
  ASSERT_EQ(socketpair(AF_UNIX, SOCK_SEQPACKET, 0, pair), 0);
  const pid_t parent = getpid();
  EXPECT_EQ(error_of_call([&] { return fcntl(pair[0], F_SETOWN, parent); }), EPERM);
  EXPECT_EQ(error_of_call([&] { return fcntl(pair[0], F_SETSIG, SIGKILL); }), EPERM);
  EXPECT_EQ(error_of_call([&] { return fcntl(pair[0], F_SETFL, O_ASYNC); }), EPERM);
  EXPECT_EQ(error_of_call([&] { return ioctl(pair[0], FIOASYNC, pair); }), EPERM);
  EXPECT_EQ(error_of_call([&] { return fcntl(pair[0], F_SETLEASE, F_RDLCK); }), EPERM);
  EXPECT_EQ(error_of_call([&] { return fcntl(pair[0], F_GETFL); }), 0);
  EXPECT_EQ(error_of_call([&] { return fcntl(pair[0], F_DUPFD_CLOEXEC, 3); }), 0);
  close(pair[0]);
  close(pair[1]);
}

TEST_F(SandboxTest, PreventsSchedulingOfOtherProcesses) {
  const pid_t parent = getpid();
  cpu_set_t processors;
  ASSERT_EQ(sched_getaffinity(0, sizeof processors, &processors), 0);
  const auto set = [&](pid_t which) { return sched_setaffinity(which, sizeof processors, &processors); };
  EXPECT_EQ(error_of_call([&] { return set(parent); }), EPERM);
  EXPECT_EQ(error_of_call([&] { return set(0); }), 0);
  EXPECT_EQ(error_of_call([&] { return setpriority(PRIO_PROCESS, parent, 19); }), EPERM);
  const auto count_processors_and_find_stack = [] {  // as the scheduler of a thread does
    enter_sandbox();
    pthread_attr_t attributes;
    const auto find_stack = [&] { return pthread_getattr_np(pthread_self(), &attributes); };
    return std::thread::hardware_concurrency() > 0 ? std::async(std::launch::async, find_stack).get() : 1;
  };
  EXPECT_EQ(result_of(count_processors_and_find_stack), 0);
}

TEST_F(SandboxTest, LandlockPreventsSignalsToOtherProcesses) {
  if (landlock_version() < 6) GTEST_SKIP() << "this kernel has no Landlock scopes";
  const pid_t parent = getpid();
  const auto attempt = [&] {
    worker::restrict_files({});
    return error_of(kill(parent, 0));
  };
  EXPECT_EQ(result_of(attempt), EPERM);
}

TEST_F(SandboxTest, HasNoCapabilities) {
  const auto attempt = [] {
    worker::restrict_files({});
    __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
    __user_cap_data_struct held[_LINUX_CAPABILITY_U32S_3]{};
    if (syscall(SYS_capget, &header, held) != 0) return 1;
    return (held[0].effective | held[0].permitted | held[1].effective | held[1].permitted) == 0 ? 0 : 1;
  };
  EXPECT_EQ(result_of(attempt), 0);
}

TEST_F(SandboxTest, BoundsFilesInMemory) {
  const auto attempt = [] {
    std::signal(SIGXFSZ, SIG_IGN);
    worker::limit_resources(1, 1 << 20);
    worker::restrict_calls();
    const int memory = memfd_create("image", MFD_ALLOW_SEALING);
    const bool most = ftruncate(memory, 1 << 20) == 0;
    const bool more = ftruncate(memory, (1 << 20) + 1) == 0 || fallocate(memory, 0, 0, 2 << 20) == 0 ||
                      pwrite(memory, "x", 1, 1 << 20) == 1;
    return most && !more ? 0 : 1;
  };
  EXPECT_EQ(result_of(attempt), 0);
}

TEST_F(SandboxTest, PreventsExecutableMemory) {
  const auto map = [](int protection) {
    return mmap(nullptr, 4096, protection, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0) == MAP_FAILED ? -1 : 0;
  };
  EXPECT_EQ(error_of_call([&] { return map(PROT_READ | PROT_WRITE); }), 0);
  EXPECT_EQ(error_of_call([&] { return map(PROT_READ | PROT_EXEC); }), EPERM);
}

TEST_F(SandboxTest, OpensAndFindsNoFiles) {
  for (const std::string& path : {inside, outside, std::string("/proc/self/mem")}) {
    EXPECT_EQ(error_of_call([&] { return open(path.c_str(), O_RDONLY); }), EPERM) << path;
    EXPECT_EQ(error_of_call([&] { return open(path.c_str(), O_PATH); }), EPERM) << path;
    EXPECT_EQ(error_of_call([&] { return open_beneath_nothing(path); }), EPERM) << path;
    struct stat status {};
    EXPECT_EQ(error_of_call([&] { return stat(path.c_str(), &status); }), EPERM) << path;
    EXPECT_EQ(error_of_call([&] { return access(path.c_str(), F_OK); }), EPERM) << path;
  }
  EXPECT_EQ(error_of_call([&] { return unlink(inside.c_str()); }), EPERM);
  EXPECT_EQ(error_of_call([&] { return rename(inside.c_str(), outside.c_str()); }), EPERM);
  EXPECT_EQ(error_of_call([&] { return chmod(inside.c_str(), 0777); }), EPERM);
  EXPECT_EQ(error_of_call([&] { return mkdir((directory.path() + "/new").c_str(), 0700); }), EPERM);
}

TEST_F(SandboxTest, LandlockAllowsReadingInItsDirectoriesOnly) {
  if (landlock_version() < 1) GTEST_SKIP() << "this kernel has no Landlock";
  const std::string link = directory.path() + "/link";
  ASSERT_EQ(symlink(outside.c_str(), link.c_str()), 0);
  const auto result = [&](const std::string& path, int flags) {
    return result_of([&] {
      worker::restrict_files({directory.path(), directory.path() + "/absent"});
      return error_of(open(path.c_str(), flags, 0600));
    });
  };
  EXPECT_EQ(result(inside, O_RDONLY), 0);
  EXPECT_EQ(result(inside, O_RDWR), EACCES);
  for (const std::string& path : {outside, link, std::string("/etc/passwd"), std::string("/proc/self/environ")})
    EXPECT_EQ(result(path, O_RDONLY), EACCES) << path;
}

TEST_F(SandboxTest, AllowsThreadsAndSharedMemory) {
  const auto start_thread = [] {
    enter_sandbox();
    int seen = 1;
    std::thread([&] { seen = 0; }).join();
    return seen;
  };
  EXPECT_EQ(result_of(start_thread), 0);
  const auto seal_memory = [] {
    enter_sandbox();
    const int memory = memfd_create("image", MFD_ALLOW_SEALING);
    if (memory < 0 || write(memory, "x", 1) != 1) return 1;
    return error_of(fcntl(memory, F_ADD_SEALS, F_SEAL_WRITE));
  };
  EXPECT_EQ(result_of(seal_memory), 0);
}

TEST_F(SandboxTest, AllowsAbort) {
  const int status = status_of([]() -> int {
    enter_sandbox();
    abort();
  });
  EXPECT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == SIGABRT && !WCOREDUMP(status)) << status;
}

TEST_F(SandboxTest, RestrictsExistingThreads) {
  const auto attempt = [] {
    worker::restrict_files({});
    int result = 0;
    std::atomic<bool> held = false;
    std::thread earlier([&] {
      while (!held) std::this_thread::yield();
      result = error_of(socket(AF_INET, SOCK_STREAM, 0));
    });
    worker::restrict_calls();
    held = true;
    earlier.join();
    return result;
  };
  EXPECT_EQ(result_of(attempt), EPERM);
}

#endif
