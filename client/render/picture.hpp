#pragma once

#include <array>
#include <optional>
#include <span>

#include "client/draw/hair_motion.hpp"
#include "client/render/gl_objects.hpp"
#include "client/render/shader_program.hpp"
#include "client/render/stage.hpp"

namespace hairnet::render {

// Draws without grain, for a window: `draw` replaces Stage::draw. Coverage of thin hair becomes samples at random,
// which a single picture shows as grain. So each picture is drawn a little aside of the one before, and is added to the
// average of those before it, which follows the motion of the camera, of heads and of their hair
// (client/shaders/accumulate.frag). Quick motion gets softer. Where the GPU cannot draw half floats it draws as the
// stage does. One thread; the context in which it was made must be current at every call, also at its destruction.
class Picture {
 public:
  static Result<Picture> build();

  // Draws to the bound framebuffer, which must store colours as they are, not encode sRGB: the average is of encoded
  // colours. A new size begins a new average.
  void draw(Stage& stage, std::span<const draw::ShownCharacter> characters, const draw::Camera& camera,
            const Look& look, int width, int height);
  // Copies the depths of the last picture to the bound framebuffer, for what is drawn over it: the window's own depths
  // are empty, because the stage draws into another target.
  void copy_depths() const;
  // Forgets all pictures before: the next one shows nothing of them. Call it when the scene is another one; a jump of
  // the camera does this by itself.
  void cut();
  // The number of pictures since the last cut.
  [[nodiscard]] int pictures() const { return number_; }

 private:
  // The camera of the last picture, by which a point of the scene is found in that picture.
  struct CameraBefore {
    draw::Camera camera;
    // Maps axes of the world, with the camera as the origin, to clip space.
    Eigen::Matrix4d to_clip;
  };
  Picture(Program accumulate, Program present, Program depths)
      : accumulate_(std::move(accumulate)), present_(std::move(present)), depths_(std::move(depths)) {}
  bool resize(int width, int height);
  // Sets where each pixel was in the last picture, for accumulate.frag.
  void set_uniforms(const Stage& stage, const CameraBefore& now, const Sampling& sampling);
  // Uploads HairMotion::swing().
  void fill_swing();
  // Draws one triangle that covers the target.
  void draw_screen() const;

  Program accumulate_, present_, depths_;
  Renderbuffer colour_samples_, depth_samples_;
  // current_ and depth_ have one sample a pixel; the samples of a picture are resolved into them. swing_ has
  // HairMotion::swing().
  Texture current_, depth_, swing_;
  Framebuffer samples_target_, current_target_;
  // Two averages take turns: one is read while the other is written.
  struct Average {
    Texture colour, count;
    Framebuffer target;
  };
  Average next_, last_;
  // OpenGL draws the single triangle over the screen with it, which has no vertex data.
  VertexArray nothing_;
  draw::HairMotion motion_;
  // None: there is no last picture, as after a cut.
  std::optional<CameraBefore> before_;
  int width_ = 0, height_ = 0, number_ = 0;
  // Without targets, pictures are drawn without an average.
  bool has_targets_ = false, has_swing_ = false;
};

// Where picture `number` has its samples, in pixels from their usual places, -0.5 to 0.5: Halton's sequence of bases 2
// and 3, whose every part covers the pixel evenly. It repeats after 32 pictures.
std::array<float, 2> place_of(int number);

}  // namespace hairnet::render
