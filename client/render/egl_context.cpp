#include "client/render/egl_context.hpp"

#include <EGL/eglext.h>

#include <array>
#include <string_view>
#include <utility>
#include <vector>

namespace hairnet::render {
namespace {

// Whether the list has this extension as a whole word: a search for a part of the text would find the name inside a
// longer one.
bool has_extension(const char* list, std::string_view wanted) {
  std::string_view rest = list == nullptr ? "" : list;
  while (!rest.empty()) {
    const std::size_t space = rest.find(' ');
    if (rest.substr(0, space) == wanted) return true;
    rest = space == std::string_view::npos ? "" : rest.substr(space + 1);
  }
  return false;
}

// The displays in the order in which they are tried. The surfaceless platform comes first, because it works without a
// display server, as in containers.
std::vector<EGLDisplay> candidate_displays() {
  std::vector<EGLDisplay> displays;
  const char* extensions = eglQueryString(EGL_NO_DISPLAY, EGL_EXTENSIONS);
  const auto get_display =
      reinterpret_cast<PFNEGLGETPLATFORMDISPLAYEXTPROC>(eglGetProcAddress("eglGetPlatformDisplayEXT"));
  if (get_display != nullptr && has_extension(extensions, "EGL_MESA_platform_surfaceless")) {
    displays.push_back(get_display(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, nullptr));
  }
  const auto query_devices = reinterpret_cast<PFNEGLQUERYDEVICESEXTPROC>(eglGetProcAddress("eglQueryDevicesEXT"));
  if (get_display != nullptr && query_devices != nullptr && has_extension(extensions, "EGL_EXT_platform_device")) {
    std::array<EGLDeviceEXT, 16> devices{};
    EGLint count = 0;
    if (query_devices(static_cast<EGLint>(devices.size()), devices.data(), &count) == EGL_TRUE) {
      for (EGLint i = 0; i < count; ++i) {
        displays.push_back(get_display(EGL_PLATFORM_DEVICE_EXT, devices[static_cast<std::size_t>(i)], nullptr));
      }
    }
  }
  displays.push_back(eglGetDisplay(EGL_DEFAULT_DISPLAY));
  return displays;
}

EGLConfig choose_config(EGLDisplay display) {
  // Zero asks for no kind of surface; without the attribute EGL would ask for windows. The second try asks for
  // off-screen surfaces, whose configurations do as well.
  for (const EGLint surface : {0, EGL_PBUFFER_BIT}) {
    const std::array<EGLint, 5> wanted{EGL_RENDERABLE_TYPE, EGL_OPENGL_ES3_BIT, EGL_SURFACE_TYPE, surface, EGL_NONE};
    EGLConfig config = nullptr;
    EGLint count = 0;
    if (eglChooseConfig(display, wanted.data(), &config, 1, &count) == EGL_TRUE && count > 0) return config;
  }
  return nullptr;
}

}  // namespace

Result<EglContext> EglContext::create_on(EGLDisplay display) {
  if (display == EGL_NO_DISPLAY) return Refusal("no EGL display");
  // Starting a display again does nothing.
  if (eglInitialize(display, nullptr, nullptr) != EGL_TRUE) return Refusal("EGL display does not start");
  const char* extensions = eglQueryString(display, EGL_EXTENSIONS);
  if (!has_extension(extensions, "EGL_KHR_surfaceless_context")) {
    return Refusal("EGL display lacks EGL_KHR_surfaceless_context");
  }
  if (eglBindAPI(EGL_OPENGL_ES_API) != EGL_TRUE) return Refusal("EGL does not know OpenGL ES");
  const EGLConfig config = choose_config(display);
  // Without a configuration the context is made with none, where the driver allows it.
  if (config == nullptr && !has_extension(extensions, "EGL_KHR_no_config_context")) {
    return Refusal("EGL display has no configuration for OpenGL ES 3");
  }
  const std::array<EGLint, 3> version{EGL_CONTEXT_CLIENT_VERSION, 3, EGL_NONE};
  const EGLContext context = eglCreateContext(display, config, EGL_NO_CONTEXT, version.data());
  if (context == EGL_NO_CONTEXT) return Refusal("EGL makes no OpenGL ES 3 context");
  EglContext made(display, context);
  if (!made.make_current()) return Refusal("EGL context cannot be made current without a surface");
  return made;
}

Result<EglContext> EglContext::create() {
  std::string first_reason;
  for (const EGLDisplay display : candidate_displays()) {
    Result<EglContext> context = create_on(display);
    if (context) return context;
    // The first display is the one that should work, so its reason helps most.
    if (first_reason.empty()) first_reason = context.error();
  }
  return Refusal("no off-screen OpenGL ES 3 (" + first_reason + "); Mesa's libegl1 and libgl1-mesa-dri suffice");
}

EglContext::EglContext(EglContext&& other) noexcept
    : display_(other.display_), context_(std::exchange(other.context_, EGL_NO_CONTEXT)) {}

// The display stays open: closing it would end the contexts of other code.
// A context that is still current would live on after its destruction.
EglContext::~EglContext() {
  if (context_ == EGL_NO_CONTEXT) return;
  if (eglGetCurrentContext() == context_) eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
  eglDestroyContext(display_, context_);
}

bool EglContext::make_current() const {
  return eglMakeCurrent(display_, EGL_NO_SURFACE, EGL_NO_SURFACE, context_) == EGL_TRUE;
}

}  // namespace hairnet::render
