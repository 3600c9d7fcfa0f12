#pragma once

#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <vector>

#include "client/link/known_basis.hpp"
#include "core/levels/level.hpp"
#include "schema/wire/messages.hpp"

namespace hairnet::link {

// The hair of one frame.
struct HairSnapshot {
  wire::GroomHash groom{};
  std::shared_ptr<const KnownBasis> basis;
  std::vector<float> coefficients;
  // The same hair in the form that a server takes.
  wire::HairState state;
};

// The last known hair of this client's own characters, stored when the connection was lost. A new server has no lattice
// until it has the groom, so it sends rigid frames at first. The link shows this hair instead. One thread.
class LastKnownHair {
 public:
  // Asserts that the hair has a basis.
  void keep(std::uint32_t character, HairSnapshot hair);
  void drop(std::uint32_t character) { last_known_.erase(character); }
  void drop_of(const wire::GroomHash& groom);
  // The connection is lost: the wait for a lattice begins again with the next server.
  void on_lost();
  // The server has the groom, so its lattice frames should follow. If they are still rigid a second after the first one
  // (the server may keep the character rigid), the last known hair is no longer shown.
  void on_ready(const wire::GroomHash& groom);
  // Returns the hair to show with a frame of this level that has none, because it is rigid or because its basis is
  // still on its way. Null: none is known.
  [[nodiscard]] const HairSnapshot* of(std::uint32_t character, LevelIndex level, std::int64_t now_ns);

 private:
  static constexpr std::int64_t kNever_ns = std::numeric_limits<std::int64_t>::max();
  // The hair of one character.
  struct Kept {
    HairSnapshot hair;
    // The server has the groom.
    bool is_ready = false;
    // While frames are rigid, the hair is shown until this time.
    std::int64_t until_ns = kNever_ns;
  };
  std::map<std::uint32_t, Kept> last_known_;
};

}  // namespace hairnet::link
