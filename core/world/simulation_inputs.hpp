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

// Names a character of a Simulation.
using CharacterKey = std::uint64_t;

// The inputs of one tick of a Simulation. Those of one kind are applied in order. They are all that a tick depends on,
// besides the levels, so a recording of them repeats a run bit by bit.
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
  struct State {
    CharacterKey character = 0;
    // Are in head space, m and m/s, on the level that the character has.
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

  // All bodies of a room, from now on.
  struct RoomBodies {
    std::uint32_t room = 0;
    std::vector<TouchBody> bodies;
  };
  struct Rule {
    CharacterKey character = 0;
    TouchRule rule;
  };
  struct LetGo {
    CharacterKey character = 0;
    TouchKey hand;
    Release release = Release::drop;
  };
  struct TakeHold {
    CharacterKey character = 0;
    Grab grab;
  };

  // The step comes after all of them, which are applied in this order.
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
