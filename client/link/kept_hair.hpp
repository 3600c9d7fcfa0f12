#pragma once

#include <cstdint>
#include <limits>
#include <map>
#include <memory>

#include "core/build/level.hpp"
#include "schema/codec/frame_codec.hpp"
#include "schema/wire/messages.hpp"

namespace hairnet::link {

// A lattice as a frame gave it.
struct Hair {
  wire::GroomHash groom{};
  codec::ErrorClass error_class = codec::ErrorClass::normal;
  wire::HairState state;
  std::shared_ptr<const LevelGeometry> geometry;
};

// The hair of own characters when their server was lost. Another server knows it, but has no lattice before it has the
// groom: what it sends until then is rigid, and this is shown in its place. One thread.
class KeptHair {
 public:
  void keep(std::uint32_t character, Hair hair) { kept_[character] = {std::move(hair), kNever_ns}; }
  void drop(std::uint32_t character) { kept_.erase(character); }
  void drop_of(const wire::GroomHash& groom);
  void drop_all() { kept_.clear(); }
  // The lattice comes now; or a while later it does not, because the server has its reasons.
  void on_ready(const wire::GroomHash& groom, std::int64_t now_ns);
  // Null: none.
  [[nodiscard]] const Hair* of(std::uint32_t character, std::int64_t now_ns) const;

 private:
  static constexpr std::int64_t kNever_ns = std::numeric_limits<std::int64_t>::max();
  struct Kept {
    Hair hair;
    std::int64_t until_ns;
  };
  std::map<std::uint32_t, Kept> kept_;
};

}  // namespace hairnet::link
