#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "client/viewer/sources/head_grab.hpp"
#include "core/groom/groom.hpp"
#include "core/groom/material_scale.hpp"
#include "core/levels/level.hpp"
#include "core/modes/moved_lattice.hpp"
#include "core/result.hpp"
#include "core/skin/skin_distance_field.hpp"
#include "core/solver/wind.hpp"
#include "schema/wire/messages.hpp"

namespace hairnet::viewer {

// One character to draw now.
struct ViewedCharacter {
  std::uint64_t id = 0;  // does not change while the character exists
  std::string name;
  std::shared_ptr<const Groom> groom;
  Vec3f hair_colour = Vec3f::Zero();           // linear RGB
  std::optional<wire::Appearance> appearance;  // replaces hair_colour; none: the default skin and roughness
  Pose pose;
  MovedLattice lattice;                           // of its hair
  LevelIndex level = LevelIndex::rigid;           // that is stepped
  std::shared_ptr<const LevelGeometry> geometry;  // of the lattice; null: at rest
  std::span<const Vec3f> displacement;            // the same of simulated hair, active order, head space, m
  std::shared_ptr<const Level> model;             // the lattice's mechanical model; null: not known here
  std::shared_ptr<const Skin> skin;               // to keep the hair out of; null: not known here
  MaterialScale material;
  LevelIndex level_wanted = LevelIndex::high;  // the finest that it may have
  bool own = false;                            // the user may grab and change it
};

// The source of the characters that a window draws and controls, simulated here (LocalWorld) or by a server (LiveRoom).
// One thread.
class HairSource {
 public:
  static constexpr double kAside_m = 0.8;  // of teleport(), along x

  virtual ~HairSource() = default;
  // Moves all characters to the moment to draw, `now_ns` of a monotonic clock. The error is one line with the reason
  // why the source has ended.
  virtual Result<void> advance(std::int64_t now_ns) = 0;
  // Valid until the next non-const call.
  [[nodiscard]] virtual std::span<const ViewedCharacter> viewed_characters() const = 0;

  // The next four calls act on own characters only. For others grab() returns null and the rest do nothing.
  virtual HeadGrab* grab(std::uint64_t id) = 0;
  virtual void set_material(std::uint64_t id, const MaterialScale& scale) = 0;
  virtual void set_level(std::uint64_t id, LevelIndex level) = 0;
  virtual void teleport(std::uint64_t id) = 0;  // a step aside; the next call moves it back

  [[nodiscard]] virtual const Wind& wind() const = 0;  // the wind of all characters
  virtual void set_wind(const Wind& wind) = 0;
  [[nodiscard]] virtual bool paused() const = 0;
  virtual void set_paused(bool paused) = 0;  // own motions stop; hair continues where a server simulates it
};

}  // namespace hairnet::viewer
