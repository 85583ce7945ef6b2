#include "src/video/cairo_library.h"

#include <dlfcn.h>

namespace gapscope {
namespace {

struct Opened {
  CairoLibrary functions;
  std::string fault;  // empty: it is there
};

Opened Open() {
  Opened opened;
  void* const library = dlopen("libcairo.so.2", RTLD_NOW | RTLD_LOCAL);
  if (!library) return {.functions = {}, .fault = dlerror()};
#define GAPSCOPE_FIND(name)                                                           \
  opened.functions.name = reinterpret_cast<decltype(&::name)>(dlsym(library, #name)); \
  if (!opened.functions.name) opened.fault = "it has no " #name;
  GAPSCOPE_CAIRO_FUNCTIONS(GAPSCOPE_FIND)
#undef GAPSCOPE_FIND
  return opened;
}

const Opened& Once() {
  static const Opened opened = Open();
  return opened;
}

}  // namespace

Status OpenCairo() {
  if (Once().fault.empty()) return Ok();
  return Error{.what = "cannot render: no cairo library",
               .where = "libcairo.so.2",
               .actual = Once().fault,
               .allowed = "",
               .cure = "install it: apt-get install libcairo2 libosmesa6 fonts-dejavu-core ffmpeg"};
}

const CairoLibrary& Cairo() {
  GS_CHECK(Once().fault.empty());
  return Once().functions;
}

}  // namespace gapscope
