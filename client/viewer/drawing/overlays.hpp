#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "client/render/overlay.hpp"
#include "client/viewer/drawing/orbit_camera.hpp"
#include "client/viewer/sources/hair_source.hpp"

namespace hairnet::viewer {

// The parts of the mechanics to draw over the hair. All but the lattice, levels and timing need the mechanical model,
// which a server does not send.
struct Overlays {
  // The active nodes, coloured by their distance from their design, and the edges between them.
  bool lattice = false;
  // The springs, coloured by strain.
  bool springs = false;
  // Lines from the points on the skull to their current places (paper eq. 4).
  bool attachments = false;
  // The points of hair that meet skin.
  bool contacts = false;
  // Each node's strongest drag, and its direction (paper eq. 6).
  bool drag = false;
  // The hair itself, in its level's colour.
  bool levels = false;
  // Graphs of the times of pictures and of the stream.
  bool timing = false;

  [[nodiscard]] bool need_model() const { return springs || attachments || contacts || drag; }
};

// The colour of each level, for hair (linear RGB).
Vec3f level_colour(LevelIndex level);

// Draws the overlays of one character, or of all when `chosen` is none. Leaves out overlays that need an unknown model,
// and characters whose hair is at rest. Adds to what `drawing` has.
void draw_overlays(const Overlays& overlays, std::span<const ViewedCharacter> viewed,
                   std::optional<std::uint64_t> chosen, render::Drawing& drawing);

// Draws the outline of a ball as the camera sees it, world, m.
void draw_ball(const Vec3& centre, double radius_m, const OrbitCamera& camera, render::Drawing& drawing);

// One line that names the characters whose model is wanted but not known; empty when all is drawn.
std::string missing_models(const Overlays& overlays, std::span<const ViewedCharacter> viewed,
                           std::optional<std::uint64_t> chosen);

}  // namespace hairnet::viewer
