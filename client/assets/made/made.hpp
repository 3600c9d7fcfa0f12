#pragma once

#include <span>
#include <string_view>

#include "core/groom/groom.hpp"
#include "core/pose/motion.hpp"
#include "core/result.hpp"

namespace hairnet {

// The project's own assets, made by code: the same options give the same bits. Any thread may call these functions.

// Head, neck and shoulders with a plain face, in head space, with bone weights and joints. Closed mesh. Its vertices
// are moved onto the zero surface of the bust's distance field. The mesh is made at each call.
Body make_bust();

struct HairstyleOptions {
  // The length of the longest strands before curling, or of the tail if tied; zero means the style's own.
  double length_m = 0;
  // From 0, straight, to 1, tight curls; a negative value means the style's own.
  double curl = -1;
  // The number of strands; zero means the style's own, some 10 000.
  std::size_t strand_count = 0;
  // Another seed gives other random numbers, and so other hair of the same style.
  std::uint32_t seed = 1;
};
// Name and description are static text.
struct MadeName {
  std::string_view name, description;
};
std::span<const MadeName> hairstyle_names();  // long_straight, long_curly, bob, ponytail, short, …
// An unknown name, or an option out of range, gives an error of one line. Any number of strands represents the hairs of
// one head, so fewer strands stand for more hairs each.
Result<Groom> make_hairstyle(std::string_view name, const HairstyleOptions& options = {});

struct MotionOptions {
  // Zero means the motion's own duration.
  double duration_s = 0;
  double rate_hz = 60;
  // The seed decides the phase and small variations of the motion.
  std::uint32_t seed = 1;
};
std::span<const MadeName> motion_names();  // nod, shake, walk, dance, lean, upside_down, …
// Begins and ends upright at rest, but not always at the same place (run and walk travel). Poses are in the world, with
// the head joint 1.55 m above the floor, at rest facing +Z. An unknown name, or an option out of range, gives an error
// of one line.
Result<Motion> make_motion(std::string_view name, const MotionOptions& options = {});

}  // namespace hairnet
