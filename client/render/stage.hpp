#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "client/draw/camera.hpp"
#include "client/draw/hair_motion.hpp"
#include "client/draw/shown_character.hpp"
#include "core/ffd/skin_push.hpp"
#include "core/groom/groom.hpp"
#include "core/modes/moved_lattice.hpp"
#include "core/pose/pose.hpp"
#include "core/result.hpp"

namespace hairnet::render {

// The light and background of a picture. The lights turn with the camera (studio_lights): key above its left, fill at
// its right, rim behind.
struct Look {
  // Multiplies all light, not the background.
  float exposure = 1;
  Vec3f background_top{0.80f, 0.81f, 0.82f}, background_bottom{0.52f, 0.53f, 0.55f};  // linear RGB
  // A factor on the detail that the size on the screen determines: strands and points; 0.1 ... 4.
  float quality = 1;
};

// What differs between the pictures of an average (Picture). A single picture has the defaults.
struct Sampling {
  // Shifts the picture, as a share of its size.
  float shift_x = 0, shift_y = 0;
  // Seeds the random numbers that turn coverage into samples.
  int dither_seed = 0;
};

// What the last picture took, for people who look for the cost in time and memory.
struct StageStatistics {
  std::size_t draw_calls = 0, strands = 0, vertices = 0;
  // Characters that did not fit into the GPU's textures, and are not in the picture.
  std::size_t left_out = 0;
  // The bytes on the GPU of all grooms and bases together, and of one character.
  std::size_t groom_bytes = 0, character_bytes = 0;
  // The bytes on the GPU of the points of the drawn strands.
  std::size_t point_bytes = 0;
};

// Draws characters with OpenGL ES 3 into the bound framebuffer. Nothing is sorted: width below a sample's share of the
// pixel becomes coverage, coverage becomes samples (alpha to coverage), and the depth test orders those. So all
// characters of a groom are one draw call for each list of strands. The price is grain in a single picture, which
// Picture and Renderer remove. It simulates nothing and keeps no character between pictures. The context in which it
// was made must be current at every call, also at its destruction. One thread.
class Stage {
 public:
  // The error is one line about what is missing.
  static Result<std::unique_ptr<Stage>> create();
  virtual ~Stage() = default;

  // Prepares the groom and uploads it to the GPU, which takes a moment; the groom must pass validate() and is not kept.
  // Returns its number in this stage; numbers of removed grooms are used again.
  virtual std::size_t add_groom(const Groom& groom) = 0;
  virtual void remove_groom(std::size_t groom) = 0;
  // From now on the groom's hair is kept out of this skin. Without a skin, hair lies where its lattice moves it, and
  // the few coefficients of a frame may move it into the body.
  virtual void set_skin(std::size_t groom, const SkinPush& skin) = 0;

  // Clears and draws `width` x `height` pixels of the bound framebuffer, which needs depth and preferably 4 samples a
  // pixel. Leaves out characters whose groom is unknown, whose pose is not finite, or that are over 10 km away: a
  // damaged pose of one must not spoil the others. `target_is_srgb` says that the target encodes colours by itself. It
  // sets all state of OpenGL that it needs, and resets little of it.
  virtual void draw(std::span<const draw::ShownCharacter> characters, const draw::Camera& camera, const Look& look,
                    int width, int height, bool target_is_srgb, const Sampling& sampling) = 0;
  // The next three are of the last draw(). The characters' lattices refer to memory of its caller.
  [[nodiscard]] virtual const StageStatistics& statistics() const = 0;
  [[nodiscard]] virtual draw::DepthRange depth_range() const = 0;
  [[nodiscard]] virtual std::span<const draw::MovingCharacter> drawn_characters() const = 0;
};

}  // namespace hairnet::render
