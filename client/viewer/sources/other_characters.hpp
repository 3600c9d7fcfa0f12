#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "client/link/link.hpp"
#include "client/link/playout.hpp"
#include "client/viewer/sources/moment.hpp"
#include "core/groom/groom.hpp"
#include "core/result.hpp"

namespace hairnet::viewer {

// Another client's character in the moments of a stream; none at moments when it was absent or its hair was unknown.
struct SeenCharacter {
  std::shared_ptr<const Groom> groom;
  wire::MemberJoined joined;                   // with its newest tag and appearance
  std::vector<std::optional<Moment>> moments;  // [time]
};

// The characters of other clients in the room: fetches their grooms, plays out their frames, and stores the moments
// that pictures need. One thread.
class OtherCharacters {
 public:
  struct Member {
    wire::MemberJoined joined;  // with its newest tag and appearance
    link::Playout playout;
    link::Playout::Sample sample;  // the last sample of play()
    bool here = true;
    std::map<std::ptrdiff_t, Moment> moments;

    [[nodiscard]] std::string name() const;  // its tag; empty if that is no text
  };

  explicit OtherCharacters(link::Link& link) : link_(link) {}

  void take(const wire::MemberJoined& joined);
  void take(const wire::MemberChanged& changed);
  void take(const wire::MemberLeft& left);
  // The error is one line when the received groom is not valid.
  Result<void> take(const link::GroomFetched& fetched);
  // The groom is not available now: requests it again later. False when no character waits for it.
  bool retry(const wire::GroomHash& groom, std::int64_t now_ns);
  // False when the frame's member is not known. Times are of the link's clock.
  bool push(const link::Frame& frame, std::int64_t sample_time_ns, std::int64_t now_ns);
  // Call it when no frames will come for a while.
  void freeze();
  // Playout::sample for all members; `moment` is the index of a wanted moment, or negative.
  void play(std::int64_t now_ns, std::ptrdiff_t moment);
  // session << 32 | the owner's number.
  [[nodiscard]] std::uint64_t name_of(std::uint32_t member) const;
  [[nodiscard]] const std::map<std::uint32_t, Member>& members() const { return members_; }
  // Null: not received yet.
  [[nodiscard]] std::shared_ptr<const Groom> groom_of(const Member& member) const;
  // One line for each that is here: its name, whose it is and its colours.
  [[nodiscard]] std::string summary() const;
  // The characters whose hair was seen in at least one moment. `moment_count`: of all moments.
  [[nodiscard]] std::vector<SeenCharacter> seen(std::size_t moment_count) const;

 private:
  static constexpr std::int64_t kRetry_ns = 1'000'000'000;
  void want(const wire::GroomHash& groom);
  void forget_unused_grooms();

  link::Link& link_;
  // also members that have left, if moments of them are stored
  std::map<std::uint32_t, Member> members_;
  std::vector<Member> gone_;                                        // members whose numbers belong to others now
  std::map<wire::GroomHash, std::shared_ptr<const Groom>> grooms_;  // null: requested
  std::map<wire::GroomHash, std::int64_t> retries_;
};

}  // namespace hairnet::viewer
