// Without a window, by EGL.
#include "index/count_text.h"
#include "index/text.h"
#include "viewer/gl/graphics_context.h"

#include <array>
#include <charconv>
#include <dlfcn.h>
#include <epoxy/egl.h>
#include <epoxy/gl.h>
#include <vector>

namespace filiform {

namespace {

const char* const kAdvice =
    "install Mesa's software renderer (Debian: apt-get install libegl1 libopengl0 libgl1-mesa-dri), which "
    "needs neither a display nor a graphics card";

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
  explicit OffscreenContext(const std::string& gpu) {
    requireLibraries();
    std::string why = "EGL lists no device";
    for (const EGLDisplay display : displays(gpu)) {
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
  // Those to try, the best one first.
  static std::vector<EGLDisplay> displays(const std::string& gpu) {
    std::vector<EGLDisplay> cards, software;
    const auto addTo = [](std::vector<EGLDisplay>& list, EGLenum platform, void* native) {
      const EGLDisplay display = eglGetPlatformDisplayEXT(platform, native, nullptr);
      if (display != EGL_NO_DISPLAY) list.push_back(display);
    };
    const bool lists = epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_EXT_platform_base");
    if (lists && epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_EXT_platform_device") &&
        epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_EXT_device_enumeration")) {
      std::array<EGLDeviceEXT, 16> devices{};
      EGLint count = 0;
      if (eglQueryDevicesEXT(static_cast<EGLint>(devices.size()), devices.data(), &count) != EGL_TRUE) count = 0;
      for (EGLint i = 0; i < count; ++i) {
        const EGLDeviceEXT device = devices[static_cast<std::size_t>(i)];
        const char* const can = eglQueryDeviceStringEXT(device, EGL_EXTENSIONS);
        const bool is_software =
            can != nullptr && std::string(can).find("EGL_MESA_device_software") != std::string::npos;
        addTo(is_software ? software : cards, EGL_PLATFORM_DEVICE_EXT, device);
      }
    }
    if (lists && epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_MESA_platform_surfaceless"))
      addTo(gpu.empty() && cards.empty() ? cards : software, EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY);
    if (gpu == "software") return software;
    if (gpu.empty()) {
      cards.insert(cards.end(), software.begin(), software.end());
      return cards;
    }
    std::size_t number = 0;
    const auto [end, error] = std::from_chars(gpu.data(), gpu.data() + gpu.size(), number);
    if (error != std::errc() || end != gpu.data() + gpu.size())
      throw UsageError("--gpu " + inShort(gpu) + ": give the number of a graphics card, from 0, or software");
    if (number >= cards.size())
      throw UsageError("--gpu " + gpu + ": EGL lists " + counted(cards.size(), "graphics card") +
                       (cards.empty() ? "; leave it out, or give software" : "; the first one is 0"));
    return {cards[number]};
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

std::unique_ptr<GraphicsContext> makeOffscreenContext(const std::string& gpu) {
  return std::make_unique<OffscreenContext>(gpu);
}

}  // namespace filiform
