#pragma once

#include <EGL/egl.h>

#include <string>

#include "core/result.hpp"

namespace hairnet::render {

// An OpenGL ES 3 context without a window or surface. The process shares one display, which stays open: other contexts
// may use it. A context belongs to the thread in which it is current.
class EglContext {
 public:
  // Tries Mesa's surfaceless platform, then every EGL device, then the default display, which may need an X server. The
  // new context is current. The error has the reason of the first try, and says which packages suffice.
  static Result<EglContext> create();
  EglContext(EglContext&& other) noexcept;
  EglContext& operator=(EglContext&&) = delete;
  ~EglContext();
  // Call it before each use where a program has several contexts; false: the driver refuses.
  [[nodiscard]] bool make_current() const;

 private:
  EglContext(EGLDisplay display, EGLContext context) : display_(display), context_(context) {}
  static Result<EglContext> create_on(EGLDisplay display);

  EGLDisplay display_;
  EGLContext context_;
};

}  // namespace hairnet::render
