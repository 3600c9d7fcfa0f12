#pragma once

#include <EGL/egl.h>

#include <string>

#include "core/result.hpp"

namespace hairnet::render {

// An OpenGL ES 3 context without a window or surface. The process shares one display, which stays open.
class EglContext {
 public:
  // Tries Mesa's surfaceless platform, then every EGL device, then the default display. The new context is current.
  static Result<EglContext> create();
  EglContext(EglContext&& other) noexcept;
  EglContext& operator=(EglContext&&) = delete;
  ~EglContext();
  [[nodiscard]] bool make_current() const;

 private:
  EglContext(EGLDisplay display, EGLContext context) : display_(display), context_(context) {}
  static Result<EglContext> create_on(EGLDisplay display);

  EGLDisplay display_;
  EGLContext context_;
};

}  // namespace hairnet::render
