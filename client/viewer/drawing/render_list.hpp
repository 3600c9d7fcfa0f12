#pragma once

#include <array>
#include <map>
#include <memory>
#include <span>
#include <vector>

#include "client/render/stage.hpp"
#include "client/viewer/sources/hair_source.hpp"

namespace hairnet::viewer {

// Draws the character in these colours: sRGB bytes, which become linear.
void apply_appearance(const wire::Appearance& appearance, draw::ShownCharacter& shown);

// Turns the characters of a source into what the renderer draws. Uploads each groom to the GPU once, which takes a
// moment, and frees it when no character uses it. One thread: that of the OpenGL context.
class RenderList {
 public:
  explicit RenderList(render::Stage& stage) : stage_(stage) {}

  // The characters for Stage::draw; valid until the next call, and while `viewed` is valid.
  std::span<const draw::ShownCharacter> show(std::span<const ViewedCharacter> viewed);
  // Replaces each character's own hair colour from now on, linear RGB; null: the own colour.
  using Colour = Vec3f (*)(const ViewedCharacter& character);
  void set_colour(Colour colour) { colour_ = colour; }

 private:
  struct OnStage {
    std::shared_ptr<const Groom> groom;
    std::size_t number = 0;
    bool used = false;
    // The skin that the stage has; null: none yet.
    std::shared_ptr<const Skin> skin;
  };
  std::size_t number_of(const ViewedCharacter& character);

  render::Stage& stage_;
  Colour colour_ = nullptr;
  std::map<const Groom*, OnStage> grooms_;
  std::vector<draw::ShownCharacter> shown_;
};

}  // namespace hairnet::viewer
