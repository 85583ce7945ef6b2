// An OpenGL context without display or graphics card, for MuJoCo's renderer.
//
// MuJoCo looks for a loader among the libraries that are already mapped: eglGetProcAddress, then OSMesaGetProcAddress.
// So a process opens one of the two libraries, at run time, and never both; and a context must be current before
// mjr_makeContext, which aborts without one.
#ifndef GAPSCOPE_REPLAY_GL_CONTEXT_H_
#define GAPSCOPE_REPLAY_GL_CONTEXT_H_

#include <memory>
#include <string>

#include "src/core/enum_names.h"
#include "src/core/result.h"

namespace gapscope {

// kAuto: OSMesa, or EGL where OSMesa's library is missing. kOsmesa renders in memory on the processor; kEgl is EGL
// without a surface, on the device that Mesa finds, else on the processor.
enum class GlBackend { kAuto, kOsmesa, kEgl };
template <>
std::span<const EnumName<GlBackend>> EnumNames<GlBackend>();  // "auto", "osmesa", "egl"

// Opens the backend's library for the process, once: later calls give the same answer when they ask for the same or
// kAuto. `note`, when it is not null, receives a line when kAuto fell back. `threads` is how many Mesa shares the
// pixels out over (the environment's LP_NUM_THREADS goes first): all contexts of a process take turns in its
// rasteriser, so this, and not a context for each worker, is what uses several processors. Errors: the library is
// missing, the other backend is already open.
Result<GlBackend> OpenGl(GlBackend wanted, int threads, std::string* note);

// A context of the open backend (see OpenGl), current on the thread that made it, and released there.
class GlContext {
 public:
  static Result<std::unique_ptr<GlContext>> Make();
  virtual ~GlContext() = default;

 protected:
  GlContext() = default;
  GlContext(const GlContext&) = delete;
  GlContext& operator=(const GlContext&) = delete;
};

}  // namespace gapscope

#endif  // GAPSCOPE_REPLAY_GL_CONTEXT_H_
