#pragma once

#include <cstdint>
#include <vector>

#include "core/groom/groom_hash.hpp"
#include "core/groom/material_scale.hpp"
#include "core/levels/level.hpp"
#include "core/pose/pose.hpp"
#include "core/solver/wind.hpp"
#include "core/touch/touch_body.hpp"
#include "core/touch/touch_rule.hpp"
#include "core/world/grab.hpp"

namespace hairnet {

// The caller's number for a character of a Simulation.
using CharacterKey = std::uint64_t;

// The inputs of one tick of a Simulation. Inputs of one kind are applied in their order. Besides the levels of grooms a
// tick depends on nothing else, so a recording of the inputs repeats a run bit by bit.
struct SimulationInputs {
  struct Add {
    CharacterKey character = 0;
    GroomHash groom{};
    // The room in whose wind the character stands; an index of World's environments.
    std::uint32_t room = 0;
    // The groom's levels were available when the character was added. Otherwise it starts rigid.
    bool levels_ready = false;
    LevelIndex level = LevelIndex::rigid;
    Pose pose;
    ToucherId owner = kRoomToucher;
  };
  struct Level {
    CharacterKey character = 0;
    LevelIndex level = LevelIndex::rigid;
  };
  struct Material {
    CharacterKey character = 0;
    MaterialScale scale;
  };
  struct Stride {
    CharacterKey character = 0;
    std::uint8_t stride = 1;
  };
  struct Suspension {
    CharacterKey character = 0;
    bool suspended = false;
  };
  // The state in which a character's hair starts (World::set_state).
  struct State {
    CharacterKey character = 0;
    // Displacements in m and velocities in m/s of the active nodes of the character's current level, head space.
    std::vector<Vec3f> displacements, velocities;
  };
  struct RoomWind {
    std::uint32_t room = 0;
    Wind wind;
  };
  struct BonePose {
    CharacterKey character = 0;
    bool teleport = false;
    Pose pose;
  };

  // All bodies of a room, from this tick on: they replace those that the room had.
  struct RoomBodies {
    std::uint32_t room = 0;
    std::vector<TouchBody> bodies;
  };
  struct Rule {
    CharacterKey character = 0;
    TouchRule rule;
  };
  // A hand lets go of a character's hair (World::let_go).
  struct LetGo {
    CharacterKey character = 0;
    TouchKey hand;
    Release release = Release::drop;
  };
  // A hand takes hold of a character's hair (World::grab).
  struct TakeHold {
    CharacterKey character = 0;
    Grab grab;
  };

  // Simulation::step applies the lists in this order, and then steps the World.
  std::vector<CharacterKey> removed;
  std::vector<Add> added;
  std::vector<Level> levels;
  std::vector<Material> materials;
  std::vector<Stride> strides;
  std::vector<Suspension> suspensions;
  std::vector<State> states;
  std::vector<RoomWind> winds;
  std::vector<BonePose> poses;
  std::vector<Rule> touch_rules;
  std::vector<RoomBodies> bodies;
  std::vector<LetGo> releases;
  std::vector<TakeHold> grabs;
};

}  // namespace hairnet
