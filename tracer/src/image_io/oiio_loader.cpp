#include "tracer/src/image_io/oiio_loader.h"

#include <dlfcn.h>

#include <filesystem>
#include <system_error>

namespace tracer {
namespace {

Result<const OpenImageIo*, std::string> load() {
  // In ../lib/whittle relative to the program; by its full path, because sanitizers intercept dlopen and do not use the
  // program's run path. Never closed: its libraries cannot be unloaded.
  std::error_code failure;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", failure);
  const auto path = program.parent_path().parent_path() / "lib/whittle/whittle_oiio.so";
  void* module = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
  void* symbol = module == nullptr ? nullptr : dlsym(module, open_image_io_symbol);
  if (symbol == nullptr) return std::string("the module for images other than PNG does not load: ") + dlerror();
  return static_cast<const OpenImageIo*>(symbol);
}

}  // namespace

Result<const OpenImageIo*, std::string> open_image_io() {
  static const Result<const OpenImageIo*, std::string> loaded = load();
  return loaded;
}

}  // namespace tracer
