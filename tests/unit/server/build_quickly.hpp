#pragma once

#include "server/grooms/level_build.hpp"
#include "tests/support/quick_training.hpp"

namespace hairnet::server {

// build_levels_here, with little training where modes are wanted.
inline LevelBuild build_quickly(const LevelBuildDef& def, const wire::GroomHash& hash,
                                std::span<const std::uint8_t> file, const Groom& groom, const GoesOn& goes_on) {
  LevelBuildDef quick = def;
  if (quick.training) quick.training = support::kQuickTraining;
  return build_levels_here(quick, hash, file, groom, goes_on);
}

}  // namespace hairnet::server
