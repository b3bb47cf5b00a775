// Without a window, by EGL.
#include "viewer/gl/graphics_context.h"

#include <array>
#include <dlfcn.h>
#include <epoxy/egl.h>
#include <epoxy/gl.h>
#include <vector>

namespace filiform {

namespace {

const char* const kAdvice =
    "install Mesa's software renderer (Debian: apt-get install libegl1 libgl1-mesa-dri), which needs neither a display "
    "nor a graphics card";

[[noreturn]] void fail(const std::string& what) {
  throw GraphicsError("OpenGL 3.3 is not available: " + what + "; " + kAdvice);
}

// libepoxy ends the program if a library is missing: check first.
void requireLibraries() {
  const auto there = [](std::initializer_list<const char*> names) {
    for (const char* name : names)
      if (dlopen(name, RTLD_LAZY | RTLD_LOCAL) != nullptr) return true;
    return false;
  };
  if (!there({"libEGL.so.1"})) fail("libEGL.so.1 is missing");
  if (!there({"libGL.so.1", "libOpenGL.so.0"})) fail("libGL.so.1 is missing");
}

class OffscreenContext final : public GraphicsContext {
 public:
  OffscreenContext() {
    requireLibraries();
    std::string why = "EGL lists no device";
    for (const EGLDisplay display : displays()) {
      if (open(display, why)) {
        watchGraphicsErrors();
        return;
      }
      eglTerminate(display);
    }
    fail(why);
  }
  OffscreenContext(const OffscreenContext&) = delete;
  OffscreenContext& operator=(const OffscreenContext&) = delete;
  ~OffscreenContext() override {
    eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    eglDestroyContext(display_, context_);
    eglTerminate(display_);
  }

  void makeCurrent() override {
    if (eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_) != EGL_TRUE)
      fail("EGL cannot make the context current");
  }
  std::string description() const override { return describeCurrentContext(); }

 private:
  static std::vector<EGLDisplay> displays() {
    std::vector<EGLDisplay> list;
    const auto add = [&](EGLenum platform, void* native) {
      const EGLDisplay display = eglGetPlatformDisplayEXT(platform, native, nullptr);
      if (display != EGL_NO_DISPLAY) list.push_back(display);
    };
    if (!epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_EXT_platform_base")) return list;
    if (epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_MESA_platform_surfaceless"))
      add(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY);
    if (epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_EXT_platform_device") &&
        epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_EXT_device_enumeration")) {
      std::array<EGLDeviceEXT, 16> devices{};
      EGLint count = 0;
      if (eglQueryDevicesEXT(static_cast<EGLint>(devices.size()), devices.data(), &count) == EGL_TRUE)
        for (EGLint i = 0; i < count; ++i) add(EGL_PLATFORM_DEVICE_EXT, devices[static_cast<std::size_t>(i)]);
    }
    return list;
  }

  bool open(EGLDisplay display, std::string& why) {
    if (eglInitialize(display, nullptr, nullptr) != EGL_TRUE) {
      why = "EGL does not start";
      return false;
    }
    if (!epoxy_has_egl_extension(display, "EGL_KHR_surfaceless_context") ||
        !epoxy_has_egl_extension(display, "EGL_KHR_no_config_context") || eglBindAPI(EGL_OPENGL_API) != EGL_TRUE) {
      why = "EGL cannot draw without a window";
      return false;
    }
    const std::array<EGLint, 7> attributes{
        EGL_CONTEXT_MAJOR_VERSION,           3,       EGL_CONTEXT_MINOR_VERSION, 3, EGL_CONTEXT_OPENGL_PROFILE_MASK,
        EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT, EGL_NONE};
    const EGLContext context = eglCreateContext(display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, attributes.data());
    if (context == EGL_NO_CONTEXT) {
      why = "the driver has no 3.3 core profile";
      return false;
    }
    if (eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, context) != EGL_TRUE) {
      eglDestroyContext(display, context);
      why = "EGL cannot make the context current";
      return false;
    }
    display_ = display;
    context_ = context;
    return true;
  }

  EGLDisplay display_ = EGL_NO_DISPLAY;
  EGLContext context_ = EGL_NO_CONTEXT;
};

}  // namespace

std::unique_ptr<GraphicsContext> makeOffscreenContext() { return std::make_unique<OffscreenContext>(); }

}  // namespace filiform
