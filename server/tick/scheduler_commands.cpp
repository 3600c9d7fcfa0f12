#include <algorithm>
#include <utility>

#include "core/assert.hpp"
#include "server/tick/scheduler.hpp"

// The part of Scheduler that runs the commands of sessions: what they change in rooms, and what other sessions are told
// of it.
namespace hairnet::server {
namespace {

// One tick announces at most this many members to one session that has joined or resumed, and to all such sessions
// together; the other members follow at later ticks. At 512 a tick, 4096 members of a room take 8 ticks, less than a
// second also at 10 Hz.
constexpr std::size_t kAnnouncementsMax = 512, kAnnouncementsOfAllMax = 4096;
// One tick sends about this many messages about characters that come and go, to all sessions together. Commands after
// the one that reaches the bound wait for the next tick.
constexpr std::int64_t kCharacterMessagesMax = 32'768;
// Changes of one character's tag and appearance are announced at most this often.
constexpr std::uint32_t kAppearanceChangesPer_s = 4;

// The message that announces the character to other sessions.
wire::MemberJoined joined_message(const Character& c) {
  return {member_of(c), session_of(c.key), number_of(c.key), c.groom, c.tag, c.appearance, c.generation};
}

}  // namespace

// Runs one command. Sessions have validated it, but time has passed: a character, session or member that it names may
// be gone, which is no error and does nothing.
struct Scheduler::CommandHandler {
  Scheduler& scheduler;
  std::int64_t now_ns;

  // A session has joined, or has resumed with a new connection (c.resumed). It is told the wind, the props and the
  // members of its room.
  void operator()(OpenSession& c) const {
    Observer* observer = c.resumed ? scheduler.rooms_.observer(c.session) : nullptr;
    const bool is_new = !observer;
    if (is_new) {
      observer = &scheduler.rooms_.open(c.session, c.room, std::move(c.sink));
      observer->subject = c.subject;
      Room& room = scheduler.rooms_.room(observer->room);
      // Only a room that begins with this session takes the wind that it had on an earlier server. A room with other
      // sessions has its own wind.
      if (c.wind && room.observers.size() == 1 && !room.wind_in_world) {
        room.wind = *c.wind;
        room.wind_announced = {*c.wind, wire::RoomWind::kOfEarlierServer};
      }
    } else {
      // The session may still have its former connection: the hands that came over it end here.
      scheduler.rooms_.end_hands(*observer);
      observer->sink = std::move(c.sink);
      // The new connection's client may be a program that has just started: it is told everything again.
      observer->bases_sent.clear();
      observer->learnt_announced.clear();
      observer->forget_sent();
    }
    if (observer->sink) observer->sink->push(scheduler.rooms_.room(observer->room).wind_announced, now_ns);
    scheduler.touch_.open(c.props, is_new, *observer, now_ns);
    // A session that resumes while its announcements wait is in announcements_ already.
    const bool is_waiting = observer->unannounced_from.has_value();
    observer->unannounced_from = 0;
    scheduler.announce_members(*observer, now_ns);
    if (observer->unannounced_from && !is_waiting) scheduler.announcements_.push_back(c.session);
  }
  void operator()(const SetTouchRight& c) const { scheduler.touch_.set_right(c); }
  void operator()(const DetachSession& c) const {
    Observer* observer = scheduler.rooms_.observer(c.session);
    if (!observer) return;
    observer->sink = nullptr;
    // The characters stay and may come back; hands without a client would hang in the air and push hair.
    scheduler.rooms_.end_hands(*observer);
  }
  void operator()(const CloseSession& c) const {
    auto& characters = scheduler.rooms_.characters();
    // Keys are ordered by session first, so a session's characters follow each other. They are copied, as remove()
    // erases them from the map.
    const auto first = characters.lower_bound(character_key(c.session, 0));
    std::vector<CharacterKey> keys;
    for (auto it = first; it != characters.end() && session_of(it->first) == c.session; ++it) keys.push_back(it->first);
    for (const CharacterKey key : keys) {
      // The tick has reached its bound of messages. run_commands() runs the same command again at the next tick.
      if (scheduler.character_messages_left_ <= 0) return;
      scheduler.remove(key, now_ns);
    }
    const Observer* observer = scheduler.rooms_.observer(c.session);
    if (observer && !c.goes_on_elsewhere) {
      Room& room = scheduler.rooms_.room(observer->room);
      // A wind goes with the person who set it.
      if (room.wind_session == c.session) scheduler.rooms_.forget_wind(room);
    }
    scheduler.rooms_.close(c.session, now_ns);
  }
  void operator()(FromClient& c) const {
    std::visit([&](auto& message) { handle(c.session, message); }, c.message);
  }
  // Sessions act on all other messages themselves.
  void handle(SessionId, const auto&) const {}
  // Adds the character, and announces it to the sessions of the room that have been told of this slot.
  void handle(SessionId session, wire::AddCharacter& add) const {
    Character* character = scheduler.rooms_.add(character_key(session, add.character), add.groom, add.level);
    if (!character) return;
    if (add.state) scheduler.store_hair_state(*character, std::move(*add.state), now_ns);
    character->tag = std::move(add.tag);
    character->appearance = add.appearance;
    // The packet is made once, and every later observer gets the same bytes.
    character->joined_packet = wire::encode_packet({now_ns, joined_message(*character)});
    Room& room = scheduler.rooms_.room(character->room);
    scheduler.character_messages_left_ -= static_cast<std::int64_t>(room.observers.size());
    for (Observer* observer : room.observers) {
      observer->observe_changed = true;
      // An observer that is not told all members yet, and has not reached this slot, is told of this one when its turn
      // comes.
      if (observer->knows(character->slot)) announce(*observer, *character, now_ns);
    }
  }
  void handle(SessionId session, const wire::RemoveCharacter& remove) const {
    scheduler.remove(character_key(session, remove.character), now_ns);
    const Observer* observer = scheduler.rooms_.observer(session);
    // The owner gets an answer even where nothing was left to remove, since it waits for one.
    if (observer && observer->sink) observer->sink->push(wire::CharacterRemoved{remove.character}, now_ns);
  }
  void handle(SessionId session, const wire::SetLevel& set) const {
    Character* character = scheduler.rooms_.find(character_key(session, set.character));
    if (!character) return;
    character->requested_level = set.level;
    if (set.level == LevelIndex::rigid) scheduler.forget_hair_state(*character);
  }
  void handle(SessionId session, wire::SetAppearance& set) const {
    Character* character = scheduler.rooms_.find(character_key(session, set.character));
    if (!character || (character->tag == set.tag && character->appearance == set.appearance)) return;
    character->tag = std::move(set.tag);
    character->appearance = set.appearance;
    character->joined_packet = wire::encode_packet({now_ns, joined_message(*character)});
    // Changes are gathered: however often an owner sends one, others hear of the newest a few times a second.
    scheduler.appearances_changed_.insert(character->key);
  }
  void handle(SessionId session, const wire::SetMaterial& set) const {
    Character* character = scheduler.rooms_.find(character_key(session, set.character));
    if (!character || character->material == set.scale) return;
    character->material = set.scale;
    scheduler.materials_changed_.insert(character->key);
  }
  void handle(SessionId session, const wire::SetWind& set) const {
    const Observer* observer = scheduler.rooms_.observer(session);
    if (!observer) return;
    Room& room = scheduler.rooms_.room(observer->room);
    // The World gets it in change_winds(), at the room's rate.
    room.wind = set.wind;
    room.wind_session = session;
  }
  void handle(SessionId session, const wire::SetTouch& set) const { scheduler.touch_.set_rule(set, session); }
  void handle(SessionId session, const wire::TakeHold& take) const {
    scheduler.touch_.take_hold(take, session, now_ns, scheduler.inputs_);
  }
  void handle(SessionId session, const wire::LetGo& let_go) const {
    scheduler.touch_.let_go(let_go, session, now_ns, scheduler.inputs_);
  }
  void handle(SessionId session, const wire::SetProps& set) const { scheduler.touch_.set_props(set, session); }
  void handle(SessionId session, wire::Observe& observe) const {
    Observer* observer = scheduler.rooms_.observer(session);
    if (!observer) return;
    observer->observe = std::move(observe);
    observer->observe_changed = true;
  }
  // Stores which members the client sees, and how large: detail goes where people look.
  void handle(SessionId session, const wire::ReportImportance& report) const {
    Observer* observer = scheduler.rooms_.observer(session);
    if (!observer) return;
    const Room& room = scheduler.rooms_.room(observer->room);
    observer->views.resize(room.slots.size());
    for (const wire::MemberImportance& m : report.members) {
      // A member that has left meanwhile is not an error.
      if (m.member == 0 || m.member > room.slots.size() || !room.slots[m.member - 1].character) continue;
      View& view = Scheduler::view_of(*observer, room, m.member - 1);
      view.screen_height = m.screen_height;
      view.in_view = m.in_view;
    }
  }
  // The client evaluates this learnt hair itself from now on. Refused where the hair was not announced to it.
  void handle(SessionId session, const wire::EvaluateLearnt& evaluate) const {
    Observer* observer = scheduler.rooms_.observer(session);
    if (!observer) return;
    const auto announced = observer->learnt_announced.find(evaluate.groom);
    if (announced != observer->learnt_announced.end() && announced->second.file == evaluate.learnt) {
      // A client asks again when frames got lost on their way, and its network begins again.
      announced->second.evaluated_since = scheduler.inputs_.tick;
      return;
    }
    scheduler.counters_->evaluations_refused.add();
    if (observer->sink)
      observer->sink->push(wire::Error{wire::ErrorReason::groom_unavailable, 0, evaluate.learnt,
                                       "no groom has that learnt hair, or it was not announced to this session"},
                           now_ns);
  }
  void operator()(const PutPoses& c) const { scheduler.rooms_.put(c); }
  void operator()(const PutHands& c) const { scheduler.rooms_.put(c); }
  void operator()(GroomReady& c) const {
    // The publisher knows the basis before any character has the levels, so the first frame can use it.
    if (c.basis) scheduler.publisher_.put_basis(c.groom, *c.basis, c.levels);
    if (c.learnt) scheduler.publisher_.put_learnt(c.groom, *c.learnt);
    if (scheduler.recorder_ && c.levels->learnt) scheduler.unrecorded_learnt_[c.groom] = c.levels->learnt;
    scheduler.simulation_.put_levels(c.groom, std::move(c.levels));
    if (scheduler.recorder_ && c.bytes) scheduler.unrecorded_[c.groom] = std::move(c.bytes);
  }
  void operator()(const ForgetGroom& c) const {
    scheduler.simulation_.forget_levels(c.groom);
    scheduler.publisher_.forget_groom(c.groom);
    for (auto& [session, observer] : scheduler.rooms_.observers()) observer.forget_files(c.groom);
    scheduler.unrecorded_.erase(c.groom);
    scheduler.unrecorded_learnt_.erase(c.groom);
  }
};

// Tells other sessions the newest tag and appearance of each character that has changed, a few times a second at most.
void Scheduler::tell_appearances(std::int64_t now_ns) {
  std::erase_if(appearances_changed_, [&](CharacterKey key) {
    Character* const character = rooms_.find(key);
    if (!character) return true;
    // A change that is too early, or beyond the tick's messages, stays in the set for a later tick.
    if (inputs_.tick < character->appearance_announced_next || character_messages_left_ <= 0) return false;
    character->appearance_announced_next = inputs_.tick + std::max(1u, def_.tick_rate_hz / kAppearanceChangesPer_s);
    const Room& room = rooms_.room(character->room);
    character_messages_left_ -= static_cast<std::int64_t>(room.observers.size());
    const wire::MemberChanged changed{member_of(*character), character->tag, character->appearance};
    const std::vector<std::uint8_t> packet = wire::encode_packet({now_ns, changed});
    for (const Observer* observer : room.observers) {
      if (observer->sink && observer->session != session_of(key) && observer->knows(character->slot))
        observer->sink->push_encoded(changed, packet, now_ns);
    }
    return true;
  });
}

// Goes on with the announcements that earlier ticks have begun, session by session.
void Scheduler::announce_members(std::int64_t now_ns) {
  announcement_count_left_ = kAnnouncementsOfAllMax;
  // Each waiting session has one turn a tick, and then goes to the end of announcements_, so that sessions in a large
  // room do not delay those in small ones.
  for (std::size_t waiting = announcements_.size(); waiting > 0 && announcement_count_left_ > 0; --waiting) {
    const SessionId session = announcements_.front();
    announcements_.pop_front();
    Observer* const observer = rooms_.observer(session);
    // The session may have gone.
    if (!observer || !observer->unannounced_from) continue;
    announce_members(*observer, now_ns);
    if (observer->unannounced_from) announcements_.push_back(session);
  }
  counters_->gauges.announcements_waiting.set(static_cast<double>(announcements_.size()));
}

void Scheduler::announce_members(Observer& observer, std::int64_t now_ns) {
  HAIRNET_ASSERT(observer.unannounced_from);
  const std::vector<Room::Slot>& slots = rooms_.room(observer.room).slots;
  std::size_t count = std::min(kAnnouncementsMax, announcement_count_left_);
  // The position is kept in slots, so members that come or go meanwhile neither repeat nor get lost.
  std::uint32_t& slot = *observer.unannounced_from;
  for (; slot < slots.size(); ++slot) {
    const Character* const character = slots[slot].character;
    if (!character) continue;
    if (count == 0) return;
    --count;
    --announcement_count_left_;
    counters_->members_announced.add();
    announce(observer, *character, now_ns);
  }
  observer.unannounced_from.reset();
}

void Scheduler::announce(const Observer& observer, const Character& c, std::int64_t now_ns) {
  if (!observer.sink) return;
  if (session_of(c.key) == observer.session)
    observer.sink->push(wire::CharacterAdded{number_of(c.key), c.groom, c.shown, member_of(c), c.generation}, now_ns);
  else
    observer.sink->push_encoded(joined_message(c), c.joined_packet, now_ns);
  // A new client assumes the default rule, which allows only the owner to touch the hair. One that resumes may know an
  // earlier rule, so a rule that has ever been told is told again.
  if (c.touch_rule != TouchRule{} || c.touch_rule_announced_next > 0) observer.sink->push(touch_message(c), now_ns);
}

// The commands that earlier ticks have left run first, so commands always run in the order of their arrival.
void Scheduler::take_commands(std::int64_t now_ns) {
  counters_->gauges.commands_waiting.set(static_cast<double>(commands_->weight()));
  character_messages_left_ = kCharacterMessagesMax;
  run_commands(now_ns);
  // New commands are taken only when no older one is left.
  if (next_command_ == taken_.size()) {
    commands_->take_all(taken_);
    next_command_ = 0;
    run_commands(now_ns);
  }
  counters_->gauges.commands_deferred.set(static_cast<double>(taken_.size() - next_command_));
}

void Scheduler::run_commands(std::int64_t now_ns) {
  for (; next_command_ < taken_.size() && character_messages_left_ > 0; ++next_command_) {
    // The bound is checked before each command, so one command may exceed it once.
    std::visit(CommandHandler{*this, now_ns}, taken_[next_command_]);
    const auto* close = std::get_if<CloseSession>(&taken_[next_command_]);
    // The observer still exists, so some of its characters are left: the same command runs again at the next tick.
    if (close && rooms_.observer(close->session)) return;
  }
}

void Scheduler::remove(CharacterKey key, std::int64_t now_ns) {
  Character* character = rooms_.find(key);
  if (!character) return;
  forget_hair_state(*character);
  // The World removes it in this tick's step, and rooms forget it at once.
  if (character->in_world) inputs_.removed.push_back(key);
  character_messages_left_ -= static_cast<std::int64_t>(rooms_.room(character->room).observers.size());
  const wire::MemberLeft left{member_of(*character)};
  const std::vector<std::uint8_t> packet = wire::encode_packet({now_ns, left});
  for (Observer* observer : rooms_.room(character->room).observers) {
    if (observer->sink && observer->session != session_of(key) && observer->knows(character->slot))
      observer->sink->push_encoded(left, packet, now_ns);
  }
  rooms_.remove(key, now_ns);
}

}  // namespace hairnet::server
