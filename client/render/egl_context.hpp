#pragma once

#include <EGL/egl.h>

#include <string>

#include "core/result.hpp"

namespace hairnet::render {

// An OpenGL ES 3 context without any window or surface. The display is shared by the process and stays open.
class EglContext {
 public:
  // Tries Mesa's surfaceless platform, then every EGL device, then the default display. The context is current after.
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
