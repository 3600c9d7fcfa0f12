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

// Says who may touch a character's hair.
wire::MemberTouch touch_message(const Character& character);

// Hands, props, who may touch whom, and holds of hair: from what sessions say to the World's inputs, and to what
// sessions are told. Costs a comparison for each room without hands and props. Tick thread.
class Touch {
 public:
  Touch(Rooms& rooms, TickCounters& counters, std::uint32_t tick_rate_hz)
      : rooms_(&rooms), counters_(&counters), tick_rate_hz_(tick_rate_hz) {}

  // Call it before the tick's commands.
  void begin_tick(SimulationInputs& inputs);

  // What sessions say. It does nothing for a session or a character that has gone. `is_new`: not resumed.
  void open(const std::vector<wire::Prop>& props, bool is_new, Observer& observer, std::int64_t now_ns);
  // A moderator allows or forbids the session to touch hair of others.
  void set_right(const SetTouchRight& right);
  // An owner says who may touch one of its characters. Only the newest rule of a tick counts.
  void set_rule(const wire::SetTouch& set, SessionId session);
  // Puts a grab into the inputs of this tick, or answers with an error. Whether hair is in reach, only the step finds
  // out; tell_holds() then tells the session.
  void take_hold(const wire::TakeHold& take, SessionId session, std::int64_t now_ns, SimulationInputs& inputs);
  // Puts a release into the inputs. A pin of hair that was taken in the same tick waits for the next one.
  void let_go(const wire::LetGo& let_go, SessionId session, std::int64_t now_ns, SimulationInputs& inputs);
  // Places, moves and removes props of the room; sessions have checked the right to.
  void set_props(const wire::SetProps& set, SessionId session);

  // Tells of changed rules, each a few times a second at most, while `messages_left` is above 0.
  void tell_rules(std::uint64_t tick, std::int64_t now_ns, std::int64_t& messages_left);
  // Samples hands, and tells of changed props. Call it when the World has the tick's characters.
  void put_inputs(std::int64_t now_ns, wire::RecordedTick& inputs);

  // Call these two after the step, the second before frames are published.
  void tell_holds(const Simulation& simulation, const wire::RecordedTick& inputs, std::int64_t now_ns);
  void show_hands(const wire::RecordedTick& inputs, const ParallelFor& parallel_for, std::int64_t now_ns);

 private:
  // A hand that holds hair of a character.
  struct Hold {
    CharacterKey character = 0;
    TouchKey hand;
    friend auto operator<=>(const Hold&, const Hold&) = default;
  };
  // Someone's hands near heads.
  struct NearHands {
    const Observer* person = nullptr;
    // Are those of the heads.
    std::vector<std::uint32_t> slots;
    // What codec::encode_hands makes of them.
    std::vector<std::uint8_t> bytes = {};
  };
  struct Head {
    double x_m = 0;
    const Character* character = nullptr;
  };

  void drop_forbidden_pins(SimulationInputs& inputs) const;
  void put_bodies(std::int64_t now_ns, Room& room, wire::RecordedTick& inputs);
  void tell_props(const Room& room, std::int64_t now_ns) const;
  void find_near_hands(const Room& room);
  void show_hands(const wire::RecordedTick& inputs, std::int64_t now_ns, Observer& observer) const;
  void tell_held(const Hold& hold, std::uint32_t point_count, std::int64_t now_ns) const;
  static void refuse(const Observer& observer, wire::ErrorReason reason, std::string detail, std::int64_t now_ns);

  Rooms* rooms_;
  TickCounters* counters_;
  std::uint32_t tick_rate_hz_;
  // The World does not know the rules of these yet, or their rooms do not.
  std::set<CharacterKey> rules_changed_, rules_unannounced_;
  // Their sessions have heard that they hold hair.
  std::set<Hold> holds_;
  // Pins of hair that was taken in the same tick: the World takes hold after it lets go.
  std::vector<SimulationInputs::LetGo> late_pins_;
  // Belong to one room at a time.
  std::vector<Head> heads_;
  std::vector<NearHands> near_;
};

}  // namespace hairnet::server
