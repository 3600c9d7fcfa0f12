#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

#include "client/link/groom_files.hpp"
#include "client/link/last_known_hair.hpp"
#include "client/link/learnt_track.hpp"
#include "schema/wire/messages.hpp"

namespace hairnet::link {

// The members of the room, as the server announced them, and the last frames of each. One thread.
class Members {
 public:
  // `decode_share`: the share of members whose frames are decoded; other frames are only counted.
  // Asserts that `catalog` is not null.
  Members(const std::shared_ptr<FileCatalog>& catalog, double decode_share);

  // The server announces all members again after a resume: those that are known already are the same, or their tag or
  // appearance has changed.
  enum class Joined : std::uint8_t { is_new, same, changed };
  Joined join(const wire::MemberJoined& joined);
  // Returns false when there is no such member, or when its tag and appearance are already these.
  bool change(const wire::MemberChanged& changed);
  bool add_own(const wire::CharacterAdded& added);
  bool leave(std::uint32_t member);
  // Does nothing where there is no such character.
  void remove_own(std::uint32_t character);
  // From now on frames want the files of those grooms alone that add_groom() has named: hair that cannot be drawn needs
  // no basis.
  void wait_for_grooms() { grooms_here_.emplace(); }
  void add_groom(const wire::GroomHash& groom) {
    if (grooms_here_) grooms_here_->insert(groom);
  }
  Bases& bases() { return bases_; }
  [[nodiscard]] const Bases& bases() const { return bases_; }
  LearntHairs& learnt() { return learnt_; }
  // The server announces the hair again over each connection, and is told again that this client evaluates it.
  void announce(const wire::GroomLearnt& announced);

  enum class Outcome : std::uint8_t {
    decoded,
    // The frame's member is not in the decoded share.
    skipped,
    // The frame's bytes are wrong. If the frame was discontinuous, the member's next frame is marked in its place.
    undecodable,
    // There is no such member, or another member had its number when the frame was made, or the frame is not newer than
    // the member's last one.
    unknown,
  };
  struct DecodedFrame {
    Outcome outcome = Outcome::unknown;
    // Names the file of a basis that the frame lacks.
    std::optional<wire::GroomHash> wants_basis;
    // Names the file of the learnt hair that the frame shows, if it is not here.
    std::optional<wire::GroomHash> wants_learnt;
    // Is the message for the server that this client evaluates the groom's learnt hair. It comes when the network is
    // here, and again when the network has missed too many frames.
    std::optional<wire::EvaluateLearnt> evaluates;
    // The frame has no coefficients, and the learnt hair is not here.
    bool lacks_learnt = false;
    // Is the frame's own mark, or that of an earlier undecodable frame.
    bool discontinuous = false;
    // Is this client's own number; zero means another client's character.
    std::uint32_t character = 0;
    // The following describe a decoded frame, and are valid until the next frame of the member.
    const Pose* pose = nullptr;
    // Holds coefficients, m; those that are missing at the end are 0. They are as coded until evaluate().
    std::span<const float> coefficients;
    // Is null when the hair is at rest, or its basis has not arrived yet.
    std::shared_ptr<const KnownBasis> basis;
  };
  // After a frame that cannot be decoded, the character still has the one before. `generation` is that of the member
  // whose frame it is, as datagrams say it; none: the frame came in order, so its member is the one of that number.
  DecodedFrame decode_frame(const wire::Frame& frame, std::optional<std::uint8_t> generation, std::uint64_t tick,
                            std::int64_t sample_time_ns, std::int64_t now_ns);

  // Evaluates learnt hair in the frames that were decoded since the last call: their coefficients become those to show.
  void evaluate();

  // The frame of a sleeping character comes once. It waits here if the groom's basis had not arrived.
  struct WaitingFrame {
    wire::Frame frame;
    std::uint64_t tick = 0;
    std::int64_t sample_time_ns = 0;
    DecodedFrame decoded;
  };
  // Decodes the frames that waited for the basis of this groom and are still the newest of their members. The result is
  // valid until the next frame.
  std::vector<WaitingFrame> decode_waiting(const wire::GroomHash& groom);
  // Returns the files of bases that waiting frames still lack and that are to be asked for again.
  std::vector<wire::GroomHash> wanted_again(std::int64_t now_ns);

  // The hair of an own character's last decoded frame, if it had coefficients of the groom's newest basis.
  [[nodiscard]] std::optional<HairSnapshot> hair_of(std::uint32_t character) const;

  // The connection broke: the next frame may be of another server, and comes later.
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
  // Is a decoded frame, as a member keeps it.
  struct Moment {
    // None means that there is no frame.
    std::optional<std::uint64_t> tick;
    std::int64_t sample_time_ns = 0;
    codec::DecodedFrame decoded;
    // Is null for a frame without hair.
    std::shared_ptr<const KnownBasis> basis;
  };
  struct Member {
    // Is the owner's session; zero means this client's own.
    std::uint64_t session = 0;
    std::uint32_t character = 0;
    wire::GroomHash groom{};
    std::string tag;
    std::optional<wire::Appearance> appearance;
    // Tells this member from earlier and later ones of its number.
    std::uint8_t generation = 0;
    // `confirmed`: the server has announced it over this connection.
    bool own = false, confirmed = true;
    // A frame that could not be shown was discontinuous.
    bool discontinuity_pending = false;
    // Is the tick of the newest frame that came, decoded or not.
    std::optional<std::uint64_t> last_tick;
    // Are the last two decoded frames.
    Moment newest, before;
    LearntTrack learnt;
    std::optional<WaitingFrame> waiting;
    // Holds the bytes of the waiting frame, whose packet is gone.
    std::vector<std::uint8_t> waiting_content;
  };
  // Is a frame whose learnt hair evaluate() is to compute. The pointer is into members_.
  struct Evaluation {
    Member* member = nullptr;
    LearntFrame frame;
    // None means that the network is not stepped for this frame.
    std::optional<LearntMotion> motion;
  };
  static bool decode(Member& member, const wire::Frame& frame, std::uint64_t tick, std::int64_t sample_time_ns,
                     const std::shared_ptr<const KnownBasis>& basis, DecodedFrame& decoded);
  // `basis_before` is the basis of the member's frame before this one.
  void follow_learnt(Member& member, const std::shared_ptr<const KnownBasis>& basis_before, const wire::Frame& frame,
                     std::int64_t now_ns, DecodedFrame& decoded);
  bool put(std::uint32_t number, Member member);
  [[nodiscard]] bool decodes(std::uint32_t number) const;

  template <class Files>
  std::optional<wire::GroomHash> wanted(Files& files, const wire::GroomHash& groom, std::int64_t now_ns) const {
    return !grooms_here_ || grooms_here_->contains(groom) ? files.wanted(groom, now_ns) : std::nullopt;
  }

  double decode_share_;
  // None means that the files of all grooms are wanted.
  std::optional<std::set<wire::GroomHash>> grooms_here_;
  std::unordered_map<std::uint32_t, Member> members_;
  Bases bases_;
  LearntHairs learnt_;
  // Whether the server is to be told, at the frame of this tick, that the network has missed too many frames.
  bool tells_of_gap(const wire::GroomHash& groom, std::uint64_t tick);

  // Holds the grooms of which the server has been told that this client evaluates their hair, each with the tick of the
  // frame at which it was told so once more; none: frames have had coefficients since.
  std::map<wire::GroomHash, std::optional<std::uint64_t>> learnt_announced_;
  std::vector<Evaluation> evaluations_;
};

}  // namespace hairnet::link
