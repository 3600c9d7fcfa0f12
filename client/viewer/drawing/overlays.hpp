#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "client/render/overlay.hpp"
#include "client/viewer/sources/hair_source.hpp"

namespace hairnet::viewer {

// What is drawn of the mechanics over the hair.
struct Overlays {
  bool lattice = false;      // active nodes, by how far they are from their design, and the edges between them
  bool springs = false;      // by strain
  bool attachments = false;  // from where they bind to where they are
  bool contacts = false;     // the points of hair that meet skin
  bool drag = false;         // each node's strongest drag, and the way it acts
  bool levels = false;       // hair in its level's colour
  bool timing = false;       // graphs

  [[nodiscard]] bool need_model() const { return springs || attachments || contacts || drag; }
};

// Of each level, for hair (linear RGB).
Vec3f level_colour(LevelIndex level);

// Of one character, or all when `chosen` is none. What needs the model is left out where it is not known.
void draw_overlays(const Overlays& overlays, std::span<const ViewedCharacter> viewed,
                   std::optional<std::uint64_t> chosen, render::Drawing& drawing);

// One line that names the characters whose model is wanted but not known; empty when all is drawn.
std::string missing_models(const Overlays& overlays, std::span<const ViewedCharacter> viewed,
                           std::optional<std::uint64_t> chosen);

}  // namespace hairnet::viewer
