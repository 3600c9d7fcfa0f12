#pragma once

#include <array>
#include <map>
#include <memory>
#include <span>
#include <vector>

#include "client/render/stage.hpp"
#include "client/viewer/sources/hair_source.hpp"

namespace hairnet::viewer {

// Turns the characters of a source into what the renderer draws. Uploads each groom to the GPU once, and frees it when
// no character uses it. One thread: that of the OpenGL context.
class StageCast {
 public:
  explicit StageCast(view::Stage& stage) : stage_(stage) {}

  // As Stage::draw takes them; valid until the next call, and as long as `subjects` are.
  std::span<const view::ShownCharacter> show(std::span<const Subject> subjects);
  // In place of each one's own hair colour from now on, linear RGB; none: its own.
  using Colour = Vec3f (*)(const Subject& subject);
  void set_colour(Colour colour) { colour_ = colour; }

 private:
  struct OnStage {
    std::shared_ptr<const Groom> groom;
    std::size_t number = 0;
    bool worn = false;
  };
  std::size_t number_of(const std::shared_ptr<const Groom>& groom);

  view::Stage& stage_;
  Colour colour_ = nullptr;
  std::map<const Groom*, OnStage> grooms_;
  std::vector<view::ShownCharacter> shown_;
};

}  // namespace hairnet::viewer
