#include "server/http/body.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <system_error>
#include <utility>

#include "server/support/file_io.h"

namespace http {
namespace {

/// A file without a name; the kernel deletes it with its descriptor, however the process ends.
int open_unlinked(const std::string& directory) {
  const int fd = ::open(directory.c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0600);
  if (fd >= 0) return fd;
  std::string path = directory + "/body-XXXXXX";  // not every file system supports O_TMPFILE
  const int named = ::mkostemp(path.data(), O_CLOEXEC);
  if (named >= 0) ::unlink(path.c_str());
  return named;
}

}  // namespace

bool Body::append(std::string_view bytes) {
  Content& content = *content_;
  if (!content.file) {
    const bool fits = content.size + bytes.size() <= content.budget.body_memory_bytes &&
                      content.budget.memory_used + bytes.size() <= content.budget.memory_bytes;
    if (fits) {
      content.memory += bytes;
      content.size += bytes.size();
      content.budget.memory_used += bytes.size();
      return true;
    }
    if (!content.spool()) return false;
  }
  if (content.budget.file_used + bytes.size() > content.budget.file_bytes) return false;
  content.size += bytes.size();
  content.budget.file_used += bytes.size();
  return support::write_all(content.file.get(), bytes);
}

bool Body::Content::spool() {
  file = support::Descriptor(open_unlinked(budget.directory));
  if (!file) return false;
  budget.memory_used -= size;
  budget.file_used += size;
  return support::write_all(file.get(), std::exchange(memory, {}));
}

std::size_t Body::read(std::uint64_t offset, char* into, std::size_t size) const {
  if (offset >= size_bytes()) return 0;
  size = std::min<std::uint64_t>(size, size_bytes() - offset);
  if (!spooled()) return content_->memory.copy(into, size, offset);
  const ssize_t count = support::read_at(content_->file.get(), offset, into, size);
  if (count < static_cast<ssize_t>(size))
    throw std::system_error(count < 0 ? errno : EIO, std::generic_category(), "spooled body");
  return size;
}

std::string Body::take() {
  if (!content_) return {};
  std::string bytes = std::move(content_->memory);
  if (spooled()) {
    bytes.resize(size_bytes());
    read(0, bytes.data(), bytes.size());
  }
  content_.reset();
  return bytes;
}

}  // namespace http
