#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "client/link/bases.hpp"
#include "client/link/last_known_hair.hpp"
#include "client/link/level_catalog.hpp"
#include "core/assert.hpp"
#include "schema/codec/frame_codec.hpp"
#include "schema/wire/messages.hpp"

namespace hairnet::link {

// The members of the room, as the server announced them, and the recent frames of each, from which the next frames are
// decoded. One thread.
class Members {
 public:
  // `decode_share`: the share of members whose frames are decoded; other frames are only counted.
  // Asserts that `catalog` is not null.
  Members(std::shared_ptr<LevelCatalog> catalog, double decode_share)
      : catalog_(std::move(catalog)), decode_share_(decode_share) {
    HAIRNET_ASSERT(catalog_);
  }

  // The server announces all members again after a resume: those that are known already are the same, or their tag or
  // appearance has changed.
  enum class Joined : std::uint8_t { is_new, same, changed };
  Joined join(const wire::MemberJoined& joined);
  bool change(const wire::MemberChanged& changed);  // false: no such member, or it has both already
  bool add_own(const wire::CharacterAdded& added);
  bool leave(std::uint32_t member);
  void remove_own(std::uint32_t character);  // if there is such a character
  std::shared_ptr<const LevelGeometry> add_level(wire::LevelRecord record);
  Bases& bases() { return bases_; }

  enum class Outcome : std::uint8_t {
    decoded,
    skipped,  // its member is not in the decoded share
    // a frame that it refers to is missing, or its bytes are wrong; if discontinuous, the next frame is marked too
    undecodable,
    unknown,  // no such member, or not newer than the last frame
  };
  struct DecodedFrame {
    Outcome outcome = Outcome::unknown;
    bool wants_keyframe = false;
    std::optional<wire::GroomHash> wants_basis;      // the file of a basis that the frame lacks
    bool discontinuous = false;                      // the frame's own mark, or that of an earlier undecodable frame
    std::uint32_t character = 0;                     // this client's own number; 0: another client's character
    const codec::FrameIntegers* integers = nullptr;  // of a decoded frame; valid until the next frame of the member
    Pose pose;                                       // decoded
    LevelIndex level = LevelIndex::rigid;            // of the geometry; the finest for frames of coefficients
    codec::ErrorClass error_class = codec::ErrorClass::half_mm;  // of the integers
    std::shared_ptr<const LevelGeometry> geometry;               // decoded; null: rigid
  };
  DecodedFrame decode_frame(const wire::Frame& frame, std::uint64_t tick, std::int64_t now_ns);

  // The lattice of an own character's last frame, if it had one that fits the level's newest geometry.
  [[nodiscard]] std::optional<HairSnapshot> hair_of(std::uint32_t character) const;

  // The connection broke: frames of the next connection do not refer to earlier ones.
  void forget_frames();
  // After a resume the server announces all members again. drop_unconfirmed() then removes those that it did not
  // announce.
  void mark_all_unconfirmed();
  // Removes and returns the old member number of the same character, if it has one that was not announced again: the
  // character left and came back during the outage.
  std::optional<std::uint32_t> drop_previous_number(std::uint64_t session, std::uint32_t character,
                                                    std::uint32_t member);
  std::vector<std::uint32_t> drop_unconfirmed();
  // The session is lost. Removes all other members and returns them.
  std::vector<std::uint32_t> drop_all();

 private:
  // Ring of the last decoded frames: as many as a frame may refer to, and one slot for the next frame.
  static constexpr std::size_t kSlotCount = codec::kHistoryMax + 1;
  struct HistoryEntry {
    bool valid = false;
    std::uint64_t tick = 0;
    LevelIndex level = LevelIndex::rigid;
    codec::ErrorClass error_class = codec::ErrorClass::half_mm;
    codec::FrameIntegers integers;
    std::shared_ptr<const LevelGeometry> geometry;  // null: rigid
  };
  struct Member {
    std::uint64_t session = 0;  // the owner's; 0: this one
    std::uint32_t character = 0;
    wire::GroomHash groom{};
    std::string tag;
    std::optional<wire::Appearance> appearance;
    bool own = false, confirmed = true;
    bool discontinuity_pending = false;  // an undecodable frame was discontinuous
    std::optional<std::uint64_t> last_tick;
    std::int64_t keyframe_asked_ns = 0;
    bool keyframe_asked = false;
    std::size_t newest = 0;  // slot
    std::array<HistoryEntry, kSlotCount> history;
    std::array<std::shared_ptr<const KnownLevel>, 4> levels;  // found before in the catalog
  };
  bool put(std::uint32_t number, Member member);
  [[nodiscard]] bool decodes(std::uint32_t number) const;
  [[nodiscard]] const KnownLevel* level_of(Member& member, LevelIndex level) const;
  [[nodiscard]] bool decode(Member& member, const wire::Frame& frame, std::uint64_t tick, DecodedFrame& decoded) const;
  [[nodiscard]] bool decode_coefficients(const Member& member, const wire::Frame& frame, HistoryEntry& entry,
                                         Pose& pose) const;
  [[nodiscard]] bool decode_nodes(Member& member, const wire::Frame& frame, std::uint64_t tick, HistoryEntry& entry,
                                  Pose& pose) const;

  std::shared_ptr<LevelCatalog> catalog_;
  double decode_share_;
  std::unordered_map<std::uint32_t, Member> members_;
  std::map<std::pair<wire::GroomHash, LevelIndex>, std::shared_ptr<const KnownLevel>> levels_;
  Bases bases_;
};

}  // namespace hairnet::link
