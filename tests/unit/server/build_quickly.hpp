#pragma once

#include <map>
#include <memory>
#include <mutex>

#include "core/modes/make_modes.hpp"
#include "server/grooms/level_build.hpp"
#include "tests/support/quick_training.hpp"

namespace hairnet::server {

// Stores the modes that build_quickly() and build_with() have made, by groom, so that a fake client can turn
// coefficients into hair. Any thread.
class BuiltModes {
 public:
  static BuiltModes& instance() {
    static BuiltModes modes;
    return modes;
  }
  void put(const wire::GroomHash& groom, std::shared_ptr<const Modes> modes) {
    const std::lock_guard lock(mutex_);
    modes_[groom] = std::move(modes);
  }
  std::shared_ptr<const Modes> of(const wire::GroomHash& groom) {
    const std::lock_guard lock(mutex_);
    return modes_[groom];
  }

 private:
  std::mutex mutex_;
  std::map<wire::GroomHash, std::shared_ptr<const Modes>> modes_;
};

// Builds levels with this training, and stores their modes.
inline LevelBuild build_with(const ModeTraining& training, const LevelBuildDef& def, const wire::GroomHash& hash,
                             std::span<const std::uint8_t> file, const Groom& groom, const GoesOn& goes_on) {
  LevelBuildDef some = def;
  some.training = training;
  LevelBuild build = build_levels_in_process(some, hash, file, groom, goes_on);
  if (build.levels) BuiltModes::instance().put(hash, build.levels->modes);
  return build;
}

// Builds levels as build_levels_in_process does, with so little training that the modes are poor (kQuickTraining).
inline LevelBuild build_quickly(const LevelBuildDef& def, const wire::GroomHash& hash,
                                std::span<const std::uint8_t> file, const Groom& groom, const GoesOn& goes_on) {
  return build_with(support::kQuickTraining, def, hash, file, groom, goes_on);
}

}  // namespace hairnet::server
