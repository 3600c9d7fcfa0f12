#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <vector>

#include "core/touch/hand.hpp"
#include "schema/wire/messages.hpp"
#include "server/exchange/character_key.hpp"
#include "server/exchange/observer_sink.hpp"
#include "server/room/frame_throttle.hpp"
#include "server/room/hands_inbox.hpp"

namespace hairnet::server {

struct Character;

// One session's view of one member: whether the session wants it, and which of its frames were sent to the session.
struct View {
  // The generation of the room's slot when the view began; zero: there is no view yet. Another generation is another
  // character.
  std::uint32_t generation = 0;
  // The session wants frames of the member, by its message Observe.
  bool wanted = true;
  // The client's last report about the member: whether it is in view, and the height of the head over the height of the
  // screen. A negative height: the client has reported none.
  bool in_view = true;
  float screen_height = -1;

  // The tick of the last frame that was sent.
  std::optional<std::uint64_t> sent;
  // The frames of the member have been of the learnt level since this tick, with no gap that a network would notice.
  std::optional<std::uint64_t> learnt_since;
  // The last frame was marked asleep.
  bool sleep_sent = false;
  // The session has not received a discontinuity yet.
  bool discontinuity_pending = false;

  // The client may not have the last frames, so the next one is marked as discontinuous.
  void forget_sent() {
    discontinuity_pending = discontinuity_pending || sent.has_value();
    sent.reset();
    learnt_since.reset();
    sleep_sent = false;
  }
};

// What a session knows of the learnt hair of a groom.
struct LearntAnnounced {
  // The file of the learnt hair that was announced to the session.
  wire::GroomHash file{};
  // The client evaluates that hair itself since this tick.
  std::optional<std::uint64_t> evaluated_since;
};

// A session as an observer of its room. Tick thread.
struct Observer {
  SessionId session = 0;
  std::uint32_t room = 0;
  // The number of the session's subject (a user or an address); all characters of a subject share one part of the
  // budget.
  std::uint32_t subject = 0;
  // Null while the session's connection is lost.
  std::shared_ptr<ObserverSink> sink;
  // The last message Observe of the session: which members it wants, at which error and stride.
  wire::Observe observe;
  // The wanted members must be chosen again. A choice by place happens at its own times instead (place_chosen_next).
  bool observe_changed = true;
  // Members are chosen by place again at this tick.
  std::uint64_t place_chosen_next = 0;
  // The members of slots from this one on have not been announced to the session, which gets no frames of them; none:
  // all members have been announced.
  std::optional<std::uint32_t> unannounced_from;
  // The views, by slot; the grooms whose basis, and whose learnt hair, was announced to the session.
  std::vector<View> views;
  std::set<wire::GroomHash> bases_sent;
  std::map<wire::GroomHash, LearntAnnounced> learnt_announced;
  // Makes frames coarser and rarer while the session's connection is slow.
  FrameThrottle throttle;

  // The samples of the session's own hands that have arrived.
  HandsInbox inbox;
  // The hands of the last tick.
  std::vector<Hand> hands;
  // False: a moderator, or the session's token, forbids it to touch the hair of others.
  bool may_touch_others = true;
  // The sessions whose hands this session was sent last, ascending.
  std::vector<SessionId> hands_shown;
  // Packets with the hands of other people, which Publisher sends with this tick's frames.
  std::vector<FramePacket> hand_packets;

  // A frame that the observer gets at this tick: `variant` is an index into Character::variants.
  struct Request {
    const Character* character = nullptr;
    std::uint32_t variant = 0;
    bool discontinuous = false;
  };
  // The frames of this tick, in the order of slots.
  std::vector<Request> requests;
  // The bytes of this tick's packets of frames and hands together.
  std::size_t sent_bytes = 0;
  // The time that choosing this tick's frames and making their packets took, without encoding.
  std::int64_t send_ns = 0;

  // True when the session has been told of the member in this slot.
  [[nodiscard]] bool knows(std::uint32_t slot) const { return !unannounced_from || slot < *unannounced_from; }
  // True when the distance between heads decides which members the session gets.
  [[nodiscard]] bool chooses_by_place() const {
    return observe.mode == wire::ObserveMode::nearest || observe.mode == wire::ObserveMode::radius;
  }
  // The groom's basis and learnt hair have changed or gone, so they must be announced again.
  void forget_files(const wire::GroomHash& groom) {
    bases_sent.erase(groom);
    learnt_announced.erase(groom);
  }
  // The last frames that were sent may not have arrived.
  void forget_sent() {
    for (View& view : views) view.forget_sent();
  }
};

}  // namespace hairnet::server
