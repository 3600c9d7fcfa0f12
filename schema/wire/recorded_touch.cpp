#include "schema/wire/recorded_touch.hpp"

#include <algorithm>
#include <functional>
#include <utility>
#include <vector>

#include "core/world/world.hpp"
#include "schema/wire/flatbuffer_convert.hpp"
#include "schema/wire/recording.hpp"

namespace hairnet::wire {
namespace {

using flatbuffers::FlatBufferBuilder;
template <class Struct>
using Structs = flatbuffers::Vector<const Struct*>;

// Bodies are recorded in double: they are interpolated on the server, and rounding them would give a replay other bits.
fb::Vec3d exact(const Vec3& v) {
  return {v.x(), v.y(), v.z()};
}
Vec3 exact(const fb::Vec3d& v) {
  return {v.x(), v.y(), v.z()};
}

fb::RecordedBody write(const TouchBody& b) {
  const Quat& q = b.place.rotation;
  return {exact(b.shape.half_size_m), b.shape.radius_m, fb::Quaterniond(q.x(), q.y(), q.z(), q.w()),
          exact(b.place.position),    b.key.toucher,    b.key.number,
          b.shape.is_inside_out,      b.has_jumped,     b.only_own};
}

TouchBody read(const fb::RecordedBody& in) {
  const fb::Quaterniond& q = in.rotation();
  TouchBody body;
  body.key = {in.toucher(), in.number()};
  body.shape = {exact(in.half_size_m()), in.radius_m(), in.is_inside_out()};
  body.place = {Quat(q.w(), q.x(), q.y(), q.z()), exact(in.position())};
  body.has_jumped = in.has_jumped();
  body.only_own = in.only_own();
  return body;
}

template <class Struct>
RecordedTouch::Vector<const Struct*> write_all(FlatBufferBuilder& to, const std::vector<Struct>& structs) {
  if (structs.empty()) return 0;
  return to.CreateVectorOfStructs(structs);
}
RecordedTouch::Vector<std::uint32_t> write_all(FlatBufferBuilder& to, const std::vector<std::uint32_t>& numbers) {
  if (numbers.empty()) return 0;
  return to.CreateVector(numbers);
}

// Calls take(struct) for each, until it returns an error.
template <class Struct>
std::string read_each(const Structs<Struct>* in, const auto& take) {
  if (!in) return {};
  if (!is_aligned(*in)) return "touch: entries not aligned";
  for (const Struct* entry : *in) {
    if (std::string error = take(*entry); !error.empty()) return error;
  }
  return {};
}

// The next `count` of `all`, which then begins behind them. Returns false when there are fewer.
template <class T>
bool take_next(std::size_t count, std::span<const T>& all, std::vector<T>& out) {
  if (count > all.size()) return false;
  out.assign(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(count));
  all = all.subspan(count);
  return true;
}

// Owners have a list of their own beside `added`, since the struct of an added character cannot grow.
std::string read_owners(const fb::RecordedTick& in, std::vector<SimulationInputs::Add>& added) {
  if (!in.owners()) return {};
  const std::span<const std::uint32_t> owners = span_of(in.owners());
  if (owners.size() != added.size()) return "owners and added characters differ in number";
  for (std::size_t i = 0; i < owners.size(); ++i) added[i].owner = owners[i];
  return {};
}

// The chosen of all rules lie in one list; each rule takes as many as it counts.
std::string read_rules(const fb::RecordedTick& in, std::vector<SimulationInputs::Rule>& out) {
  std::span<const std::uint32_t> chosen = span_of(in.chosen());
  std::string error = read_each(in.touch_rules(), [&](const fb::RecordedRule& entry) -> std::string {
    TouchRule& rule = out.emplace_back(SimulationInputs::Rule{entry.character(), {}}).rule;
    if (!take_next(entry.chosen_count(), chosen, rule.chosen)) return "touch rules: fewer chosen than counted";
    // The World searches them by halves, so their order is part of what makes a rule valid.
    if (!std::ranges::is_sorted(rule.chosen)) return "touch rule: the chosen do not ascend";
    rule.audience = static_cast<TouchAudience>(entry.audience());
    return rule.audience <= TouchAudience::everyone ? "" : "touch rule: no such audience";
  });
  if (error.empty() && !chosen.empty()) error = "touch rules: more chosen than counted";
  return error;
}

std::string read_bodies(const fb::RecordedTick& in, std::vector<SimulationInputs::RoomBodies>& out) {
  std::vector<TouchBody> bodies;
  std::string error =
      read_each(in.bodies(), [&](const fb::RecordedBody& entry) { return validate(bodies.emplace_back(read(entry))); });
  std::span<const TouchBody> left = bodies;
  if (error.empty())
    error = read_each(in.room_bodies(), [&](const fb::RecordedRoomBodies& entry) -> std::string {
      SimulationInputs::RoomBodies& room = out.emplace_back(SimulationInputs::RoomBodies{entry.room(), {}});
      if (!take_next(entry.body_count(), left, room.bodies)) return "bodies: fewer than counted";
      // The World takes bodies in the order of their keys, each once.
      const auto unordered = std::ranges::adjacent_find(room.bodies, std::ranges::greater_equal{}, &TouchBody::key);
      return unordered == room.bodies.end() ? check_room(room.room) : "bodies: their keys do not ascend";
    });
  // Bodies that no room takes would be lost silently, and the replay would differ.
  if (error.empty() && !left.empty()) error = "bodies: more than counted";
  return error;
}

std::string read_release(const fb::RecordedRelease& entry, std::vector<SimulationInputs::LetGo>& out) {
  const auto release = static_cast<Release>(entry.release());
  out.push_back({entry.character(), {entry.toucher(), entry.number()}, release});
  return release <= Release::unpin ? "" : "release: no such kind";
}

std::string read_grab(const fb::RecordedGrab& entry, std::vector<SimulationInputs::TakeHold>& out) {
  const Grab grab{{entry.toucher(), entry.number()}, exact(entry.place()), entry.radius_m()};
  out.push_back({entry.character(), grab});
  if (!grab.place.allFinite()) return "grab: its place is not finite";
  // The result is false for NaN.
  const bool is_radius = grab.radius_m >= 0 && grab.radius_m <= kGrabRadiusMax_m;
  return is_radius ? "" : "grab: its radius is out of range";
}

}  // namespace

RecordedTouch write_touch(FlatBufferBuilder& to, const SimulationInputs& inputs) {
  std::vector<std::uint32_t> owners, chosen;
  for (const SimulationInputs::Add& added : inputs.added) owners.push_back(added.owner);
  // The list is left out where nobody owns a character, as in recordings made without touch.
  if (std::ranges::count(owners, kRoomToucher) == std::ssize(owners)) owners.clear();
  std::vector<fb::RecordedRule> rules;
  for (const auto& [character, rule] : inputs.touch_rules) {
    rules.emplace_back(character, static_cast<std::uint32_t>(rule.chosen.size()),
                       static_cast<std::uint8_t>(rule.audience));
    chosen.insert(chosen.end(), rule.chosen.begin(), rule.chosen.end());
  }
  std::vector<fb::RecordedRoomBodies> rooms;
  std::vector<fb::RecordedBody> bodies;
  for (const SimulationInputs::RoomBodies& room : inputs.bodies) {
    rooms.emplace_back(room.room, static_cast<std::uint32_t>(room.bodies.size()));
    for (const TouchBody& body : room.bodies) bodies.push_back(write(body));
  }
  std::vector<fb::RecordedRelease> releases;
  for (const auto& [character, hand, release] : inputs.releases)
    releases.emplace_back(character, hand.toucher, hand.number, static_cast<std::uint8_t>(release));
  std::vector<fb::RecordedGrab> grabs;
  for (const auto& [character, grab] : inputs.grabs)
    grabs.emplace_back(character, exact(grab.place), grab.radius_m, grab.hand.toucher, grab.hand.number);
  return {write_all(to, owners), write_all(to, chosen),   write_all(to, rules), write_all(to, rooms),
          write_all(to, bodies), write_all(to, releases), write_all(to, grabs)};
}

std::string read_touch(const fb::RecordedTick& in, SimulationInputs& out) {
  std::string error = read_owners(in, out.added);
  if (error.empty()) error = read_rules(in, out.touch_rules);
  if (error.empty()) error = read_bodies(in, out.bodies);
  if (error.empty())
    error = read_each(in.releases(), [&](const fb::RecordedRelease& r) { return read_release(r, out.releases); });
  if (error.empty()) error = read_each(in.grabs(), [&](const fb::RecordedGrab& g) { return read_grab(g, out.grabs); });
  return error;
}

std::string check_room(std::uint32_t room) {
  static_assert(kRecordedRoomCountMax <= kEnvironmentCountMax);
  return room < kRecordedRoomCountMax
             ? std::string()
             : "room " + std::to_string(room) + ", not below " + std::to_string(kRecordedRoomCountMax);
}

}  // namespace hairnet::wire
