// Stands in front of libc's file calls and, as FAILING_FILES says, makes one of them go wrong:
//   no_nameless    the file system knows no O_TMPFILE
//   full           the disk is found to be full when the file is flushed
//   kill_at_flush  SIGKILL when all is written and nothing has its name
//   kill_at_name   the same just after the old file's replacement got its passing name
#include <dlfcn.h>
#include <fcntl.h>
#include <sys/types.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdarg>
#include <cstdlib>
#include <cstring>

namespace {

bool asked_for(const char* failure) {
  const char* wanted = std::getenv("FAILING_FILES");
  return wanted != nullptr && std::strcmp(wanted, failure) == 0;
}

template <class Call>
Call next(const char* name) {
  return reinterpret_cast<Call>(dlsym(RTLD_NEXT, name));
}

}  // namespace

extern "C" {

int open(const char* path, int flags, ...) {
  va_list rest;
  va_start(rest, flags);
  const mode_t mode = (flags & (O_CREAT | O_TMPFILE)) != 0 ? va_arg(rest, mode_t) : 0;
  va_end(rest);
  if ((flags & O_TMPFILE) == O_TMPFILE && asked_for("no_nameless")) {
    errno = EOPNOTSUPP;
    return -1;
  }
  return next<int (*)(const char*, int, ...)>("open")(path, flags, mode);
}

int fsync(int descriptor) {
  if (asked_for("kill_at_flush")) kill(getpid(), SIGKILL);
  if (asked_for("full")) {
    errno = ENOSPC;
    return -1;
  }
  return next<int (*)(int)>("fsync")(descriptor);
}

int rename(const char* from, const char* to) {
  if (asked_for("kill_at_name")) kill(getpid(), SIGKILL);
  return next<int (*)(const char*, const char*)>("rename")(from, to);
}
}
