#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <vector>

#include "schema/wire/messages.hpp"
#include "server/exchange/character_key.hpp"
#include "server/exchange/observer_sink.hpp"
#include "server/room/frame_throttle.hpp"

namespace hairnet::server {

struct Character;

// One session's view of one member: whether the session wants it, and which of its frames were sent to the session.
struct View {
  std::uint32_t generation = 0;  // of the room's slot, when the view began; 0: no view yet
  bool wanted = true;            // by the session's Observe
  bool in_view = true;           // as last reported
  float screen_height = -1;      // as last reported; negative: never

  std::optional<std::uint64_t> sent;  // tick of the last frame
  // Tick since which its frames have been of the learnt level, with no gap that a network would notice.
  std::optional<std::uint64_t> learnt_since;
  bool sleep_sent = false;             // the last frame was marked asleep
  bool discontinuity_pending = false;  // a discontinuity that the session has not received yet

  void forget_sent() {
    discontinuity_pending = discontinuity_pending || sent.has_value();
    sent.reset();
    learnt_since.reset();
    sleep_sent = false;
  }
};

// What a session knows of the learnt hair of a groom.
struct LearntTold {
  wire::GroomHash file{};  // that was announced to it
  // Tick since which the client evaluates that hair itself.
  std::optional<std::uint64_t> evaluated_since;
};

// A session as an observer of its room. Tick thread.
struct Observer {
  SessionId session = 0;
  std::uint32_t room = 0;
  std::uint32_t subject = 0;           // that its session belongs to
  std::shared_ptr<ObserverSink> sink;  // null while its connection is lost
  wire::Observe observe;
  bool observe_changed = true;  // the members that it wants are not chosen yet; does not count for a choice by place
  std::uint64_t place_chosen_next = 0;  // first tick at which members may be chosen by place again
  // Members of slots from here on have not been announced to the session, and it gets no frames of them; none: all
  // have.
  std::optional<std::uint32_t> unannounced_from;
  std::vector<View> views;                            // by slot
  std::set<wire::GroomHash> bases_sent;               // by groom
  std::map<wire::GroomHash, LearntTold> learnt_told;  // by groom
  FrameThrottle throttle;

  // This tick's frames.
  struct Request {
    const Character* character = nullptr;
    std::uint32_t variant = 0;
    bool discontinuous = false;
  };
  std::vector<Request> requests;
  std::size_t sent_bytes = 0;  // of their packets
  std::int64_t send_ns = 0;    // time spent on them, without encoding

  [[nodiscard]] bool knows(std::uint32_t slot) const { return !unannounced_from || slot < *unannounced_from; }
  [[nodiscard]] bool chooses_by_place() const {
    return observe.mode == wire::ObserveMode::nearest || observe.mode == wire::ObserveMode::radius;
  }
  void forget_files(const wire::GroomHash& groom) {
    bases_sent.erase(groom);
    learnt_told.erase(groom);
  }
  // The last frames that were sent may not have arrived.
  void forget_sent() {
    for (View& view : views) view.forget_sent();
  }
};

}  // namespace hairnet::server
