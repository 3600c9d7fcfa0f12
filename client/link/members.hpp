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

  // After a resume the server announces all members again. A member that was known before is then `same`, or `changed`
  // if its tag or appearance is another one.
  enum class Joined : std::uint8_t { is_new, same, changed };
  Joined join(const wire::MemberJoined& joined);
  // Returns false when there is no such member, or when its tag and appearance are already these.
  bool change(const wire::MemberChanged& changed);
  // Returns whether the server announces this own character for the first time, not again after a resume.
  bool add_own(const wire::CharacterAdded& added);
  // Returns false where there is no such member.
  bool leave(std::uint32_t member);
  // Does nothing where there is no such character.
  void remove_own(std::uint32_t character);
  // From now on frames ask for bases and networks only of grooms that add_groom() has named: hair that cannot be drawn
  // needs no basis.
  void wait_for_grooms() { grooms_here_.emplace(); }
  void add_groom(const wire::GroomHash& groom) {
    if (grooms_here_) grooms_here_->insert(groom);
  }
  Bases& bases() { return bases_; }
  [[nodiscard]] const Bases& bases() const { return bases_; }
  LearntHairs& learnt() { return learnt_; }
  // Takes the announcement of a groom's learnt hair. It comes again over each connection, and this client then tells
  // the server again that it evaluates the hair.
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
    // The file of the basis that the frame needs and that is to be requested now; none: nothing to request.
    std::optional<wire::GroomHash> wants_basis;
    // The file of the learnt hair that is to be requested now; none: nothing to request.
    std::optional<wire::GroomHash> wants_learnt;
    // A message to send: this client evaluates the groom's learnt hair. It comes when the network is here, and again
    // when the network has missed too many frames.
    std::optional<wire::EvaluateLearnt> evaluates;
    // The frame has no coefficients, and the learnt hair is not here.
    bool lacks_learnt = false;
    // The frame's own mark, or that of an earlier frame that was never shown.
    bool discontinuous = false;
    // The client's own number of its character; zero means another client's character.
    std::uint32_t character = 0;
    // The following describe a decoded frame, and are valid until the next frame of the member.
    const Pose* pose = nullptr;
    // Coefficients of `basis`, m; those that are missing at the end are 0. Until evaluate() they are as the server
    // coded them, which for learnt hair is not yet what to show.
    std::span<const float> coefficients;
    // Null when the hair is at rest, or its basis has not arrived yet.
    std::shared_ptr<const KnownBasis> basis;
  };
  // A frame that cannot be decoded leaves the character as the frame before has put it. `generation` tells members of
  // one number apart, as datagrams have it; none: the frame came in order, so the member of that number now is meant.
  DecodedFrame decode_frame(const wire::Frame& frame, std::optional<std::uint8_t> generation, std::uint64_t tick,
                            std::int64_t sample_time_ns, std::int64_t now_ns);

  // Evaluates learnt hair in the frames that were decoded since the last call: their coefficients become those to show.
  void evaluate();

  // A sleeping character gets only one frame, which waits here if the groom's basis had not arrived.
  struct WaitingFrame {
    wire::Frame frame;
    std::uint64_t tick = 0;
    std::int64_t sample_time_ns = 0;
    DecodedFrame decoded;
  };
  // Decodes the frames that have waited for the basis of this groom. The result refers to the members, and is valid
  // until the next frame of any of them.
  std::vector<WaitingFrame> decode_waiting(const wire::GroomHash& groom);
  // Returns the bases that frames still wait for and whose request should be repeated now.
  std::vector<wire::GroomHash> wanted_again(std::int64_t now_ns);

  // The hair of an own character's last decoded frame, if it had coefficients of the groom's newest basis.
  [[nodiscard]] std::optional<HairSnapshot> hair_of(std::uint32_t character) const;

  // The connection broke. The next frame may come from another server, so nothing is computed from the frames before
  // it.
  void forget_frames();
  // After a resume the server announces all members again. drop_unconfirmed() then removes those that it did not
  // announce.
  void mark_all_unconfirmed();
  // A character that left and came back during the outage has a new member number. Removes and returns its old number;
  // none: it had none, or the server has announced it again.
  std::optional<std::uint32_t> drop_previous_number(std::uint64_t session, std::uint32_t character,
                                                    std::uint32_t member);
  // Removes the members that the server has not announced since mark_all_unconfirmed(). Returns the numbers of those
  // that are other clients' characters, in rising order.
  std::vector<std::uint32_t> drop_unconfirmed();
  // The session is lost. Removes all members, and returns the numbers of those that are other clients' characters.
  std::vector<std::uint32_t> drop_all();

 private:
  // One decoded frame of a member.
  struct Moment {
    // None means that there is no such frame.
    std::optional<std::uint64_t> tick;
    std::int64_t sample_time_ns = 0;
    codec::DecodedFrame decoded;
    // Null for a frame without hair.
    std::shared_ptr<const KnownBasis> basis;
  };
  struct Member {
    // The owner's session; zero means this client's own.
    std::uint64_t session = 0;
    std::uint32_t character = 0;
    wire::GroomHash groom{};
    std::string tag;
    std::optional<wire::Appearance> appearance;
    // Tells this member from earlier and later ones of its number.
    std::uint8_t generation = 0;
    // `own`: it is this client's character. `confirmed`: the server has announced it over this connection.
    bool own = false, confirmed = true;
    // A discontinuous frame was lost, late or undecodable: the next frame must be discontinuous in its place.
    bool discontinuity_pending = false;
    // The tick of the newest frame that came, decoded or not.
    std::optional<std::uint64_t> last_tick;
    // The last two decoded frames.
    Moment newest, before;
    LearntTrack learnt;
    std::optional<WaitingFrame> waiting;
    // A copy of the waiting frame's bytes, which lay in a packet that is gone.
    std::vector<std::uint8_t> waiting_content;
  };
  // A frame whose learnt hair the next evaluate() computes. `member` points into members_, whose nodes do not move.
  struct Evaluation {
    Member* member = nullptr;
    LearntFrame frame;
    // None means that the network is not stepped for this frame.
    std::optional<LearntMotion> motion;
  };
  // Writes the frame into member.newest. Returns false where the bytes are wrong; member.newest is then as before.
  static bool decode(Member& member, const wire::Frame& frame, std::uint64_t tick, std::int64_t sample_time_ns,
                     const std::shared_ptr<const KnownBasis>& basis, DecodedFrame& decoded);
  // Prepares evaluate() for this frame. `basis_before` is the basis of the member's frame before it.
  void follow_learnt(Member& member, const std::shared_ptr<const KnownBasis>& basis_before, const wire::Frame& frame,
                     std::int64_t now_ns, DecodedFrame& decoded);
  // Adds the member, or confirms it where it is known. Returns whether it is new.
  bool put(std::uint32_t number, Member member);
  // Whether the member belongs to the share whose frames are decoded.
  [[nodiscard]] bool decodes(std::uint32_t number) const;

  // The groom's file to request now (GroomFiles::wanted), unless the groom itself is still missing.
  template <class Files>
  std::optional<wire::GroomHash> wanted(Files& files, const wire::GroomHash& groom, std::int64_t now_ns) const {
    return !grooms_here_ || grooms_here_->contains(groom) ? files.wanted(groom, now_ns) : std::nullopt;
  }

  double decode_share_;
  // The grooms that add_groom() has named. None means that the files of all grooms are wanted.
  std::optional<std::set<wire::GroomHash>> grooms_here_;
  std::unordered_map<std::uint32_t, Member> members_;
  Bases bases_;
  LearntHairs learnt_;
  // Whether the server is to be told, at the frame of this tick, that the network has missed too many frames.
  bool tells_of_gap(const wire::GroomHash& groom, std::uint64_t tick);

  // The grooms of which the server knows that this client evaluates their hair. The value is the tick at which the
  // client repeated this because of a gap; none: it has not, or frames have had coefficients since.
  std::map<wire::GroomHash, std::optional<std::uint64_t>> learnt_announced_;
  // The work of the next evaluate().
  std::vector<Evaluation> evaluations_;
};

}  // namespace hairnet::link
