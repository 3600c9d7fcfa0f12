#pragma once

#include "client/view/gl_objects.hpp"

namespace hairnet::view {

// What the key light sees of one character: the body's depth, the first hair's depth, and the optical depth of the
// hair in four layers behind that (studio.glsl reads them).
class LightMaps {
 public:
  static constexpr int kSide = 512, kBodySide = 1024;

  LightMaps();
  // Each binds its target, sets the state for that pass and clears.
  void begin_body_depth() const;
  void begin_first_depth() const;
  void begin_layers() const;
  // For reading, on the units that studio.glsl names.
  void bind_textures() const;

 private:
  Texture body_, first_, layers_;
  Framebuffer body_target_, first_target_, layers_target_;
};

}  // namespace hairnet::view
