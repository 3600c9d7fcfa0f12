#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "core/result.hpp"
#include "core/world/simulation.hpp"
#include "schema/wire/recording.hpp"

namespace hairnet::sim {

// A Simulation that takes its inputs from the entries of a recording. The server steps the same class, so one function
// steps both. It refuses entries that contradict each other, and builds the levels of a groom when a character first
// needs them. Recordings come from files, so nothing in them is trusted. One thread.
class ReplayedWorld {
 public:
  using BuildProgress = std::function<void(double fraction, std::string_view stage)>;
  explicit ReplayedWorld(BuildProgress progress) : progress_(std::move(progress)) {}

  // Takes the header or a groom. Returns an error for a second header, values out of range, and grooms that do not
  // decode. The header comes first; a groom comes before the tick that needs it.
  Result<void> take(const wire::RecordingHeader& header);
  Result<void> take(const wire::RecordedGroom& groom);
  Result<void> take(const wire::RecordedLearnt& learnt);
  // Applies a tick, steps, and compares the hash. The error is one line: the recording is inconsistent, or a hash
  // differs. Do not go on after an error.
  Result<void> take(const wire::RecordedTick& tick);

  // Call it only after the header.
  [[nodiscard]] const Simulation& simulation() const { return *simulation_; }
  // The characters that are there after the last tick, and their grooms.
  [[nodiscard]] const std::map<CharacterKey, wire::GroomHash>& characters() const { return characters_; }
  // Null until the recording has its groom. The character must be there, also for the next two.
  [[nodiscard]] const Groom* groom(CharacterKey character) const;
  // The lattice of `displacement`; null when rigid. It belongs to the levels, and stays while the character has them.
  [[nodiscard]] const LevelGeometry* lattice_of(CharacterKey character) const;
  [[nodiscard]] double rate_hz() const { return rate_hz_; }
  // Returns the displacements of its active nodes, head space, m; where the hair is learnt, those of the finest level,
  // which are computed into `scratch`. They are empty when rigid, and valid until the next tick.
  [[nodiscard]] std::span<const Vec3f> displacement(CharacterKey character, std::vector<Vec3f>& scratch) const;

 private:
  // What the recording has of one groom.
  struct RecordedLevels {
    Groom groom;
    // The set has modes once hair is learnt.
    std::shared_ptr<const LevelSet> levels;
    // The levels are to have this learnt hair.
    std::shared_ptr<const LearntHair> learnt;
  };
  Result<std::shared_ptr<const LevelSet>> levels_of(const wire::GroomHash& hash);
  Result<void> prepare(const wire::RecordedTick& tick);
  Result<void> prepare(const wire::RecordedAdd& added);
  Result<void> prepare(const wire::RecordedLevel& level);
  // Passes the levels of a groom to the simulation, and builds them first where needed. Returns an error when the groom
  // does not have this level.
  Result<void> give_levels(const wire::GroomHash& groom, LevelIndex level);
  [[nodiscard]] Result<void> is_known(CharacterKey character, const char* what) const;

  BuildProgress progress_;
  // The ticks a second of the recording; 0 before the header.
  double rate_hz_ = 0;
  std::optional<Simulation> simulation_;
  std::map<wire::GroomHash, RecordedLevels> grooms_;
  // The characters that are there, with their grooms.
  std::map<CharacterKey, wire::GroomHash> characters_;
};

}  // namespace hairnet::sim
