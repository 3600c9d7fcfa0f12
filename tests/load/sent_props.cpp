#include "tests/load/sent_props.hpp"

#include <algorithm>
#include <utility>

namespace hairnet::load {
namespace {

// A prop has at most so many changes in memory: those of some 40 s at 72 poses a second (PropSetter). No answer that
// comes later is expected.
constexpr std::size_t kChangesMax = 1024;

}  // namespace

void SentProps::add(std::uint32_t room, std::uint32_t client, std::int64_t sent_ns, const wire::SetProps& change) {
  std::map<std::uint8_t, History>& props = rooms_[room];
  for (const std::uint8_t number : change.removed) add({client, sent_ns, std::nullopt}, props[number]);
  for (const wire::Prop& prop : change.props)
    add({client, sent_ns, prop.place.position.cast<float>()}, props[prop.number]);
}

void SentProps::add(Change change, History& to) {
  to.changes.push_back(std::move(change));
  if (to.changes.size() <= kChangesMax) return;
  to.changes.pop_front();
  ++to.forgotten;
}

SentProps::Seen SentProps::until_now(std::uint32_t room) const {
  Seen seen;
  const auto found = rooms_.find(room);
  if (found == rooms_.end()) return seen;
  for (const auto& [number, history] : found->second) seen[number] = history.forgotten + history.changes.size();
  return seen;
}

std::vector<std::int64_t> SentProps::show(std::uint32_t room, std::uint32_t client, const wire::RoomProps& announced,
                                          Seen& seen) const {
  std::vector<std::int64_t> sent_ns;
  const auto found = rooms_.find(room);
  if (found == rooms_.end()) return sent_ns;
  const auto show_prop = [&](std::uint8_t number, const std::optional<Vec3f>& place) {
    const auto history = found->second.find(number);
    if (history != found->second.end()) show(history->second, client, place, seen[number], sent_ns);
  };
  for (const std::uint8_t number : announced.removed) show_prop(number, std::nullopt);
  for (const wire::Prop& prop : announced.props) show_prop(prop.number, prop.place.position.cast<float>());
  return sent_ns;
}

// The oldest change that the announcement can be, among those that the client has not been shown, is the one that it
// shows, since announcements come in order.
void SentProps::show(const History& history, std::uint32_t client, const std::optional<Vec3f>& place,
                     std::uint64_t& seen, std::vector<std::int64_t>& sent_ns) {
  const std::uint64_t forgotten = history.forgotten;
  const auto unseen = history.changes.begin() + static_cast<std::ptrdiff_t>(std::max(seen, forgotten) - forgotten);
  const auto shown = std::find_if(unseen, history.changes.end(), [&](const Change& c) { return c.place == place; });
  if (shown == history.changes.end()) return;
  for (auto change = unseen; change <= shown; ++change)
    if (change->client != client) sent_ns.push_back(change->sent_ns);
  seen = forgotten + static_cast<std::uint64_t>(shown - history.changes.begin()) + 1;
}

}  // namespace hairnet::load
