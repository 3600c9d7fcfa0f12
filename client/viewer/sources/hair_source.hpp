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

// One character to draw now: a snapshot that a HairSource makes for each picture.
struct ViewedCharacter {
  // Does not change while the character exists; a HairSource counts from 1. It names the character for the mouse, the
  // panel and the average of pictures.
  std::uint64_t id = 0;
  std::string name;
  std::shared_ptr<const Groom> groom;
  // Linear RGB.
  Vec3f hair_colour = Vec3f::Zero();
  // The colours of hair and skin and the roughness, in place of hair_colour; none: hair_colour, with the default skin
  // and roughness.
  std::optional<wire::Appearance> appearance;
  Pose pose;
  // The lattice of its hair. Its spans belong to the source, and are valid until the source's next non-const call.
  MovedLattice lattice;
  // The level that is stepped, which may be coarser than level_wanted.
  LevelIndex level = LevelIndex::rigid;
  // The lattice's geometry; null means at rest.
  std::shared_ptr<const LevelGeometry> geometry;
  // The displacements of simulated hair, in active order, head space, m; `lattice` has the same for all nodes. Empty
  // for a server's hair, whose lattice has coefficients.
  std::span<const Vec3f> displacement;
  // The lattice's mechanical model, for overlays; null means not known here, since servers send none.
  std::shared_ptr<const Level> model;
  // The hair is pushed out of this skin; null means not known here.
  std::shared_ptr<const Skin> skin;
  // Scales the groom's own materials.
  MaterialScale material;
  // The finest level that it may have.
  LevelIndex level_wanted = LevelIndex::high;
  // The user may grab and change it: it is this program's own, not another client's.
  bool own = false;
};

// The source of the characters that a window draws and controls, simulated here (LocalWorld) or by a server (LiveRoom).
// So the window has one path for both. All calls come from one thread.
class HairSource {
 public:
  // teleport() moves the character this far along x, world. The pose says that it jumps: at a low rate of poses the
  // speed alone would not show it.
  static constexpr double kAside_m = 0.8;

  virtual ~HairSource() = default;
  // Moves all characters to the moment to draw, `now_ns` of a monotonic clock that never decreases. The error is one
  // line with the reason why the source has ended; the window then closes.
  virtual Result<void> advance(std::int64_t now_ns) = 0;
  // Valid until the next non-const call.
  [[nodiscard]] virtual std::span<const ViewedCharacter> viewed_characters() const = 0;

  // The next four calls act on own characters only. For others grab() returns null and the rest do nothing, as for an
  // id that is not there.
  virtual HeadGrab* grab(std::uint64_t id) = 0;
  virtual void set_material(std::uint64_t id, const MaterialScale& scale) = 0;
  virtual void set_level(std::uint64_t id, LevelIndex level) = 0;
  // Steps aside; the next call moves it back. The hair does not swing after either.
  virtual void teleport(std::uint64_t id) = 0;

  // The wind blows on all characters; in a server's room, on everyone's.
  [[nodiscard]] virtual const Wind& wind() const = 0;
  virtual void set_wind(const Wind& wind) = 0;
  [[nodiscard]] virtual bool paused() const = 0;
  // Stops the motions of own heads. Hair continues where a server simulates it, and comes to rest.
  virtual void set_paused(bool paused) = 0;
};

}  // namespace hairnet::viewer
