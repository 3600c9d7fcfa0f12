#include "tests/load/fleet.hpp"

#include <algorithm>
#include <utility>

#include "tests/load/bad_client.hpp"
#include "tests/load/client.hpp"

namespace hairnet::load {

Fleet::Fleet(const Plan& plan, ClientContext context, std::int64_t begin_ns)
    : plan_(&plan), context_(std::move(context)), begin_ns_(begin_ns), schedule_(make_schedule(plan)) {
  context_.hand_clocks = &hand_clocks_;
  context_.sent_props = &sent_props_;
  context_.wake = [this](std::uint32_t client, std::int64_t at_ns) { wake(client, at_ns); };
}

void Fleet::advance(std::int64_t now_ns) {
  context_.tally->note_population(now_ns, counted_clients_, characters_);
  while (next_action_ < schedule_.size() && begin_ns_ + schedule_[next_action_].at_ns <= now_ns)
    perform(schedule_[next_action_++], now_ns);
  while (!queue_.empty() && queue_.top().at_ns <= now_ns) {
    const Due due = queue_.top();
    queue_.pop();
    act(due, now_ns);
  }
  remove_gone();
}

void Fleet::act(const Due& due, std::int64_t now_ns) {
  // Skips an outdated entry: its client is gone, or the client's entry with the time due_ns counts instead.
  const auto found = virtual_clients_.find(due.client);
  if (found == virtual_clients_.end() || found->second.due_ns != due.at_ns) return;
  found->second.due_ns = kNever_ns;
  const std::int64_t next_ns = found->second.virtual_client->act(now_ns);
  if (found->second.virtual_client->gone()) maybe_gone_.push_back(due.client);
  wake(due.client, next_ns);
}

void Fleet::wake(std::uint32_t client, std::int64_t at_ns) {
  const auto found = virtual_clients_.find(client);
  if (found == virtual_clients_.end() || at_ns >= found->second.due_ns) return;
  found->second.due_ns = at_ns;
  queue_.push({at_ns, client});
}

void Fleet::perform(const Action& action, std::int64_t now_ns) {
  // Joins and lost connections are timed from the intended time, not from the time at which this thread gets to them. A
  // late generator would otherwise hide a part of its clients' wait.
  const std::int64_t intended_ns = begin_ns_ + action.at_ns;
  context_.tally->record_lag(intended_ns, now_ns);
  if (action.kind == Action::Kind::join) return join(action, now_ns);
  const auto found = virtual_clients_.find(action.client);
  if (found == virtual_clients_.end()) return;
  VirtualClient& virtual_client = *found->second.virtual_client;
  // The action may change the number of this client's characters, so they are counted again behind the switch. A client
  // that leaves is not counted any more, although it still waits for the end of its connection.
  characters_ -= virtual_client.character_count();
  switch (action.kind) {
    case Action::Kind::join:
      break;
    case Action::Kind::leave:
    case Action::Kind::vanish:
      if (virtual_client.counts()) --counted_clients_;
      virtual_client.leave(action.kind == Action::Kind::leave, now_ns);
      break;
    case Action::Kind::lose_connection:
      virtual_client.lose_connection(intended_ns, now_ns);
      break;
    case Action::Kind::set_characters:
      virtual_client.set_characters(action.characters, plan_->stages[action.stage].levels, now_ns);
      break;
  }
  if (action.kind != Action::Kind::leave && action.kind != Action::Kind::vanish)
    characters_ += virtual_client.character_count();
  maybe_gone_.push_back(action.client);
}

void Fleet::join(const Action& action, std::int64_t now_ns) {
  Member& member = virtual_clients_[action.client];
  // A slow client is an ordinary client that reads too little. Each other kind of misbehaviour is a BadClient.
  const bool is_client = !action.misbehaviour || *action.misbehaviour == Misbehaviour::slow;
  if (is_client) {
    auto client = std::make_unique<Client>(context_, action.client, action.place, action.misbehaviour.has_value());
    Client& joining = *client;
    member.virtual_client = std::move(client);
    joining.join(action.characters, plan_->stages[action.stage].levels, begin_ns_ + action.at_ns, now_ns);
  } else {
    member.virtual_client = std::make_unique<BadClient>(context_, action.client, *action.misbehaviour);
  }
  if (member.virtual_client->counts()) ++counted_clients_;
  characters_ += member.virtual_client->character_count();
  wake(action.client, now_ns);
}

void Fleet::remove_gone() {
  for (const std::uint32_t client : std::exchange(maybe_gone_, {})) {
    const auto found = virtual_clients_.find(client);
    if (found != virtual_clients_.end() && found->second.virtual_client->gone()) virtual_clients_.erase(found);
  }
}

std::int64_t Fleet::next_ns() const {
  std::int64_t next = queue_.empty() ? kNever_ns : queue_.top().at_ns;
  if (next_action_ < schedule_.size()) next = std::min(next, begin_ns_ + schedule_[next_action_].at_ns);
  return next;
}

void Fleet::finish(std::int64_t now_ns) {
  context_.tally->note_population(now_ns, counted_clients_, characters_);
  next_action_ = schedule_.size();
  for (auto& [client, member] : virtual_clients_) {
    member.virtual_client->leave(true, now_ns);
    maybe_gone_.push_back(client);
  }
  counted_clients_ = characters_ = 0;
  remove_gone();
}

}  // namespace hairnet::load
