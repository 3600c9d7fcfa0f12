#pragma once

#include <array>

#include "client/render/gl_objects.hpp"
#include "client/render/shader_program.hpp"
#include "core/ffd/skin_push.hpp"

namespace hairnet::render {

// A groom's skin on the GPU, for the shaders that push hair out of it (skin_push.glsl). Before fill() none is known,
// and nothing is pushed: a server sends the skin after the groom.
class SkinTexture {
 public:
  SkinTexture();
  // Uploads the skin, or another one in place of it.
  void fill(const SkinPush& skin);
  // Binds the texture and sets its uniforms, for the program in use.
  void use(const Program& program) const;
  [[nodiscard]] std::size_t bytes() const { return bytes_; }

 private:
  Texture nodes_;
  // The uniforms of each bone's grid: its origin and the size of a cell, then its three sizes and the number of its
  // first node in the texture.
  std::array<Eigen::Vector4f, kBoneCount> place_, dims_;
  float thickness_m_ = 0;
  // The bytes of the texture.
  std::size_t bytes_ = 0;
};

}  // namespace hairnet::render
