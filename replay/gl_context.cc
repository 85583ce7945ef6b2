#include "replay/gl_context.h"

#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <GL/osmesa.h>
#include <dlfcn.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <mutex>
#include <vector>

namespace gapscope {
namespace {

// What is open in this process.
struct Opened {
  std::mutex mutex;
  GlBackend backend = GlBackend::kAuto;  // kAuto: nothing yet
  void* library = nullptr;
};
Opened& Process() {
  static Opened opened;
  return opened;
}

template <class Function>
Function Symbol(const char* name) {
  return reinterpret_cast<Function>(dlsym(Process().library, name));
}

const char* const kOsmesaLibraries[] = {"libOSMesa.so.8", "libOSMesa.so.6", "libOSMesa.so"};
const char* const kEglLibraries[] = {"libEGL.so.1", "libEGL.so"};
constexpr const char* kInstall =
    "on Debian: apt-get install libosmesa6 (or libegl1 libegl-mesa0 libgl1-mesa-dri for --gl egl)";

Status Open(GlBackend backend) {
  std::string reason;
  const auto attempt = [&](const char* name) {
    if (Process().library) return;
    // Global: MuJoCo finds the loader's entry among the symbols of the process.
    Process().library = dlopen(name, RTLD_NOW | RTLD_GLOBAL);
    if (!Process().library && reason.empty()) reason = dlerror();
  };
  if (backend == GlBackend::kOsmesa) {
    for (const char* name : kOsmesaLibraries) attempt(name);
  } else {
    for (const char* name : kEglLibraries) attempt(name);
  }
  if (Process().library) {
    Process().backend = backend;
    return Ok();
  }
  return Error{.what = "cannot render: no OpenGL library",
               .where = "--gl " + NameOf(backend),
               .actual = reason,
               .cure = kInstall};
}

class OsmesaContext : public GlContext {
 public:
  static Result<std::unique_ptr<GlContext>> Make() {
    const auto create = Symbol<decltype(&OSMesaCreateContextAttribs)>("OSMesaCreateContextAttribs");
    const auto make_current = Symbol<decltype(&OSMesaMakeCurrent)>("OSMesaMakeCurrent");
    const auto destroy = Symbol<decltype(&OSMesaDestroyContext)>("OSMesaDestroyContext");
    if (!create || !make_current || !destroy)
      return Error{.what = "cannot render: this libOSMesa is too old", .where = "--gl osmesa", .cure = kInstall};
    const int attributes[] = {OSMESA_FORMAT,
                              OSMESA_RGBA,
                              OSMESA_DEPTH_BITS,
                              24,
                              OSMESA_STENCIL_BITS,
                              8,
                              OSMESA_PROFILE,
                              OSMESA_COMPAT_PROFILE,
                              0};
    std::unique_ptr<OsmesaContext> made(new OsmesaContext);
    made->context_ = create(attributes, nullptr);
    made->make_current_ = make_current;
    made->destroy_ = destroy;
    if (!made->context_ || !make_current(made->context_, made->pixels_.data(), GL_UNSIGNED_BYTE, kSide, kSide)) {
      return Error{.what = "cannot render: OSMesa gives no context", .where = "--gl osmesa", .cure = "try --gl egl"};
    }
    return std::unique_ptr<GlContext>(std::move(made));
  }
  ~OsmesaContext() override {
    if (!context_) return;
    make_current_(nullptr, nullptr, 0, 0, 0);
    destroy_(context_);
  }

 private:
  // MuJoCo draws into a framebuffer of its own; the context's is never seen.
  static constexpr int kSide = 16;
  std::array<unsigned char, 4 * kSide * kSide> pixels_{};
  OSMesaContext context_ = nullptr;
  decltype(&OSMesaMakeCurrent) make_current_ = nullptr;
  decltype(&OSMesaDestroyContext) destroy_ = nullptr;
};

class EglContext : public GlContext {
 public:
  static Result<std::unique_ptr<GlContext>> Make() {
    const auto no_context = [](const std::string& what) {
      return Error{.what = "cannot render: " + what, .where = "--gl egl", .cure = kInstall};
    };
    const auto display = Display();
    if (!display.ok()) return display.error();
    std::unique_ptr<EglContext> made(new EglContext);
    made->display_ = display.value();
    made->make_current_ = Symbol<decltype(&eglMakeCurrent)>("eglMakeCurrent");
    made->destroy_ = Symbol<decltype(&eglDestroyContext)>("eglDestroyContext");
    const auto bind = Symbol<decltype(&eglBindAPI)>("eglBindAPI");
    const auto choose = Symbol<decltype(&eglChooseConfig)>("eglChooseConfig");
    const auto create = Symbol<decltype(&eglCreateContext)>("eglCreateContext");
    const EGLint wanted[] = {EGL_SURFACE_TYPE, EGL_PBUFFER_BIT, EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_NONE};
    EGLConfig config = nullptr;
    EGLint count = 0;
    if (!bind(EGL_OPENGL_API) || !choose(made->display_, wanted, &config, 1, &count) || count < 1)
      return no_context("EGL has no desktop OpenGL");
    made->context_ = create(made->display_, config, EGL_NO_CONTEXT, nullptr);
    if (made->context_ == EGL_NO_CONTEXT) return no_context("EGL gives no context");
    if (!made->make_current_(made->display_, EGL_NO_SURFACE, EGL_NO_SURFACE, made->context_))
      return no_context("EGL gives no context without a surface");
    return std::unique_ptr<GlContext>(std::move(made));
  }
  ~EglContext() override {
    if (context_ == EGL_NO_CONTEXT) return;
    make_current_(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    destroy_(display_, context_);
  }

 private:
  // One display for the process, made by the first thread that asks.
  static Result<EGLDisplay> Display() {
    static const EGLDisplay display = [] {
      const auto get_proc = Symbol<decltype(&eglGetProcAddress)>("eglGetProcAddress");
      const auto initialize = Symbol<decltype(&eglInitialize)>("eglInitialize");
      const auto platform_display =
          reinterpret_cast<PFNEGLGETPLATFORMDISPLAYEXTPROC>(get_proc("eglGetPlatformDisplayEXT"));
      const auto query_devices = reinterpret_cast<PFNEGLQUERYDEVICESEXTPROC>(get_proc("eglQueryDevicesEXT"));
      if (!platform_display) return EGL_NO_DISPLAY;
      std::vector<EGLDisplay> displays = {
          platform_display(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr)};
      EGLDeviceEXT devices[16];
      EGLint count = 0;
      if (query_devices && query_devices(16, devices, &count)) {
        for (EGLint i = 0; i < count; ++i)
          displays.push_back(platform_display(EGL_PLATFORM_DEVICE_EXT, devices[i], nullptr));
      }
      for (EGLDisplay candidate : displays) {
        if (candidate != EGL_NO_DISPLAY && initialize(candidate, nullptr, nullptr)) return candidate;
      }
      return EGL_NO_DISPLAY;
    }();
    if (display == EGL_NO_DISPLAY)
      return Error{.what = "cannot render: EGL has no display without a screen", .where = "--gl egl", .cure = kInstall};
    return display;
  }
  EGLDisplay display_ = EGL_NO_DISPLAY;
  EGLContext context_ = EGL_NO_CONTEXT;
  decltype(&eglMakeCurrent) make_current_ = nullptr;
  decltype(&eglDestroyContext) destroy_ = nullptr;
};

}  // namespace

template <>
std::span<const EnumName<GlBackend>> EnumNames<GlBackend>() {
  static constexpr EnumName<GlBackend> kNames[] = {
      {GlBackend::kAuto, "auto"}, {GlBackend::kOsmesa, "osmesa"}, {GlBackend::kEgl, "egl"}};
  return kNames;
}

Result<GlBackend> OpenGl(GlBackend wanted, int threads, std::string* note) {
  Opened& opened = Process();
  const std::lock_guard lock(opened.mutex);
  if (opened.backend != GlBackend::kAuto) {
    if (wanted == GlBackend::kAuto || wanted == opened.backend) return opened.backend;
    return Error{.what = "cannot render with two OpenGL libraries in one process",
                 .where = "--gl " + NameOf(wanted),
                 .actual = NameOf(opened.backend) + " is open"};
  }
  constexpr int kMost = 16;  // Mesa's own limit
  setenv("LP_NUM_THREADS", threads > 1 ? std::to_string(std::min(threads, kMost)).c_str() : "0", 0);
  if (wanted != GlBackend::kAuto) {
    GS_RETURN_IF_ERROR(Open(wanted));
    return opened.backend;
  }
  const Status osmesa = Open(GlBackend::kOsmesa);
  if (osmesa.ok()) return opened.backend;
  if (!Open(GlBackend::kEgl).ok()) return osmesa.error();
  if (note) *note = "rendering with EGL: " + osmesa.error().actual;
  return opened.backend;
}

Result<std::unique_ptr<GlContext>> GlContext::Make() {
  GS_CHECK(Process().library != nullptr);
  return Process().backend == GlBackend::kEgl ? EglContext::Make() : OsmesaContext::Make();
}

}  // namespace gapscope
