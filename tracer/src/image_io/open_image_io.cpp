#include "tracer/src/image_io/open_image_io.h"

#include <dlfcn.h>

namespace tracer {
namespace {

Result<const OpenImageIo*, std::string> load() {
  // Found by the program's run path, ../lib/whittle seen from it. Never closed: libraries hold on to themselves.
  void* module = dlopen("whittle_oiio.so", RTLD_NOW | RTLD_LOCAL);
  void* symbol = module == nullptr ? nullptr : dlsym(module, open_image_io_symbol);
  if (symbol == nullptr) return std::string("the module for pictures other than PNG does not load: ") + dlerror();
  return static_cast<const OpenImageIo*>(symbol);
}

}  // namespace

Result<const OpenImageIo*, std::string> open_image_io() {
  static const Result<const OpenImageIo*, std::string> loaded = load();
  return loaded;
}

}  // namespace tracer
