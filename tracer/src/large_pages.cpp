/// Large blocks of memory in pages of 2 MiB: linked into the programs that read scenes and trace them, whose every
/// vector of some size gains by it. The kernel meets small pages one by one at about a microsecond each, which was a
/// fifth of the time of a document of 10 MB and a tenth of that of simple images. The price is memory: of a block
/// that is not used to its end, up to one such page more. Sanitizers keep their own.

#if !defined(WHITTLE_SANITIZED)

#include <sys/mman.h>

#include <cstddef>
#include <cstdlib>
#include <new>

namespace {

constexpr std::size_t page = std::size_t{1} << 21;

/// Null: no memory.
void* block(std::size_t bytes) {
  if (bytes < page) return std::malloc(bytes != 0 ? bytes : 1);
  void* const begin = std::aligned_alloc(page, bytes);
  // Of what it spans alone: others' may lie behind it. Advice, where it is not taken the pages are small.
  if (begin != nullptr) ::madvise(begin, bytes / page * page, MADV_HUGEPAGE);
  return begin;
}

}  // namespace

void* operator new(std::size_t bytes) {
  for (;;) {
    if (void* const begin = block(bytes)) return begin;
    const std::new_handler handler = std::get_new_handler();
    if (handler == nullptr) throw std::bad_alloc();
    handler();
  }
}
void operator delete(void* begin) noexcept { std::free(begin); }
void operator delete(void* begin, std::size_t /*bytes*/) noexcept { std::free(begin); }

#endif
