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
#include "core/world/world.hpp"
#include "schema/wire/recording.hpp"

namespace hairnet::sim {

// A world controlled by a recording's entries. It builds grooms when a character first needs their levels.
class ReplayedWorld {
 public:
  using BuildProgress = std::function<void(double fraction, std::string_view stage)>;
  explicit ReplayedWorld(BuildProgress progress) : progress_(std::move(progress)) {}

  // Takes the header or a groom. Returns an error for a second header, values out of range, and grooms that do not
  // decode.
  Result<void> take(const wire::RecordingHeader& header);
  Result<void> take(const wire::RecordedGroom& groom);
  Result<void> take(const wire::RecordedLearnt& learnt);
  // Applies a tick and steps. The error is one line: the recording is inconsistent, or a hash differs.
  Result<void> take(const wire::RecordedTick& tick);

  [[nodiscard]] const World& world() const { return *world_; }
  [[nodiscard]] double tick_s() const { return tick_s_; }
  struct Character {
    CharacterId id;
    wire::GroomHash groom{};
    bool has_levels = false, has_learnt = false;
  };
  [[nodiscard]] const std::map<std::uint64_t, Character>& characters() const { return characters_; }
  // Of its active nodes, head space, m: those of the finest level where the hair is learnt, which are computed into
  // `scratch`; empty when rigid.
  [[nodiscard]] std::span<const Vec3f> displacement(const Character& character, std::vector<Vec3f>& scratch) const;

 private:
  struct RecordedLevels {
    Groom groom;
    std::shared_ptr<const LevelSet> levels;    // with modes once hair is learnt
    std::shared_ptr<const LearntHair> learnt;  // that they are to have
  };
  Result<std::shared_ptr<const LevelSet>> levels_of(const wire::GroomHash& hash);
  Result<void> add(const wire::RecordedAdd& added);
  Result<void> set_level(const wire::RecordedLevel& level);

  BuildProgress progress_;
  double tick_s_ = 0;
  Environment environment_;
  std::optional<World> world_;
  std::map<wire::GroomHash, RecordedLevels> grooms_;
  std::map<std::uint64_t, Character> characters_;
};

}  // namespace hairnet::sim
