#pragma once

#include <compare>
#include <cstdint>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "core/parallel_for.hpp"
#include "core/world/simulation.hpp"
#include "schema/wire/recording.hpp"
#include "server/exchange/command.hpp"
#include "server/room/room.hpp"
#include "server/tick/tick_counters.hpp"

namespace hairnet::server {

// The message that tells the clients of a room who may touch the character's hair.
wire::MemberTouch touch_message(const Character& character);

// Hands, props, who may touch whom, and holds of hair. Takes the messages of sessions about them, makes the World's
// inputs of them, and sends the sessions what concerns them. A room without hands and props costs one comparison a
// tick. Tick thread.
class Touch {
 public:
  // `rooms` and `counters` must outlive this object.
  Touch(Rooms& rooms, TickCounters& counters, std::uint32_t tick_rate_hz)
      : rooms_(&rooms), counters_(&counters), tick_rate_hz_(tick_rate_hz) {}

  // Puts the pins that waited for this tick into its inputs. Call it before the tick's commands.
  void begin_tick(SimulationInputs& inputs);

  // The calls from here to set_props() pass on a message of a session. They do nothing for a session or a character
  // that has gone.

  // A session has joined (`is_new`) or resumed. `props` are those that come with it, as after a change of server.
  void open(const std::vector<wire::Prop>& props, bool is_new, Observer& observer, std::int64_t now_ns);
  // A moderator allows or forbids the session to touch hair of others.
  void set_right(const SetTouchRight& right);
  // An owner says who may touch one of its characters. Only the newest rule of a tick counts.
  void set_rule(const wire::SetTouch& set, SessionId session);
  // Puts a grab into the inputs of this tick, or answers with an error. Only the step finds out whether hair is in
  // reach; tell_holds() then tells the session.
  void take_hold(const wire::TakeHold& take, SessionId session, std::int64_t now_ns, SimulationInputs& inputs);
  // Puts a release into the inputs. A pin of hair that was taken in the same tick waits for the next one.
  void let_go(const wire::LetGo& let_go, SessionId session, std::int64_t now_ns, SimulationInputs& inputs);
  // Places, moves and removes props of the room; sessions have checked the right to.
  void set_props(const wire::SetProps& set, SessionId session);

  // Tells sessions who may touch the characters whose rule has changed, each a few times a second at most, while
  // `messages_left` is above 0. Subtracts the messages from it.
  void tell_rules(std::uint64_t tick, std::int64_t now_ns, std::int64_t& messages_left);
  // Samples hands, tells sessions of changed props, and puts rules and bodies into the inputs. Call it when `inputs`
  // has the tick's new characters.
  void put_inputs(std::int64_t now_ns, wire::RecordedTick& inputs);

  // After the step: tells each session that has tried to take hold how many points its hand has got, and tells it when
  // a hold has ended. 0 points mean that no hair was in reach.
  void tell_holds(const Simulation& simulation, const wire::RecordedTick& inputs, std::int64_t now_ns);
  // After the step and before frames are published: prepares for each observer the hands of other people near the heads
  // that it sees (Observer::hand_packets). Publisher sends them.
  void show_hands(const wire::RecordedTick& inputs, const ParallelFor& parallel_for, std::int64_t now_ns);

 private:
  // A hand that holds hair of a character.
  struct Hold {
    CharacterKey character = 0;
    TouchKey hand;
    friend auto operator<=>(const Hold&, const Hold&) = default;
  };
  // The hands of one person, who is near the heads of characters.
  struct NearHands {
    const Observer* person = nullptr;
    // The slots of the characters whose heads are near.
    std::vector<std::uint32_t> slots;
    // The hands as codec::encode_hands has coded them.
    std::vector<std::uint8_t> bytes = {};
  };
  // A character and the x coordinate of its head in the world, by which heads_ is sorted.
  struct Head {
    double x_m = 0;
    const Character* character = nullptr;
  };

  // Turns pins into drops where the session may not touch the hair any more.
  void drop_forbidden_pins(SimulationInputs& inputs) const;
  // Samples the hands of the room, and puts all bodies of the room into the inputs if any of them has changed.
  void put_bodies(std::int64_t now_ns, Room& room, wire::RecordedTick& inputs);
  // Announces the props in RoomTouch::props_changed to the observers of the room.
  void tell_props(const Room& room, std::int64_t now_ns) const;
  // Fills near_ with the people of the room whose hands are within kShownReach_m of a head.
  void find_near_hands(const Room& room);
  // Makes the packets of hands for one observer.
  void show_hands(const wire::RecordedTick& inputs, std::int64_t now_ns, Observer& observer) const;
  // Tells the owner of the hand how many points of the lattice the hand holds now; 0: the hold has ended.
  void tell_held(const Hold& hold, std::uint32_t point_count, std::int64_t now_ns) const;
  // Answers the observer's message with an error.
  static void refuse(const Observer& observer, wire::ErrorReason reason, std::string detail, std::int64_t now_ns);

  Rooms* rooms_;
  TickCounters* counters_;
  std::uint32_t tick_rate_hz_;
  // The characters whose present rule the World does not know yet, and those whose rule the sessions of the room do not
  // know yet.
  std::set<CharacterKey> rules_changed_, rules_unannounced_;
  // The holds that sessions know of: they were told that their hand holds hair.
  std::set<Hold> holds_;
  // Pins that wait for the next tick, because the hair was taken in this one: within a step the World releases hair
  // before it takes hold.
  std::vector<SimulationInputs::LetGo> late_pins_;
  // Buffers of show_hands(), for one room at a time.
  std::vector<Head> heads_;
  std::vector<NearHands> near_;
};

}  // namespace hairnet::server
