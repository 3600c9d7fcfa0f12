#include "tests/load/fleet.hpp"

#include <algorithm>
#include <utility>

#include "tests/load/bad_client.hpp"
#include "tests/load/client.hpp"

namespace hairnet::load {

Fleet::Fleet(const Plan& plan, Props props, std::int64_t begin_ns)
    : plan_(&plan), props_(std::move(props)), begin_ns_(begin_ns), schedule_(make_schedule(plan)) {
  props_.wake = [this](std::uint32_t client, std::int64_t at_ns) { wake(client, at_ns); };
}

void Fleet::advance(std::int64_t now_ns) {
  props_.tally->note_population(now_ns, counted_clients_, characters_);
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
  const auto found = actors_.find(due.client);
  if (found == actors_.end() || found->second.due_ns != due.at_ns) return;
  found->second.due_ns = kNever_ns;
  const std::int64_t next_ns = found->second.actor->act(now_ns);
  if (found->second.actor->gone()) maybe_gone_.push_back(due.client);
  wake(due.client, next_ns);
}

void Fleet::wake(std::uint32_t client, std::int64_t at_ns) {
  const auto found = actors_.find(client);
  if (found == actors_.end() || at_ns >= found->second.due_ns) return;
  found->second.due_ns = at_ns;
  queue_.push({at_ns, client});
}

void Fleet::perform(const Action& action, std::int64_t now_ns) {
  const std::int64_t intended_ns = begin_ns_ + action.at_ns;
  props_.tally->record_lag(intended_ns, now_ns);
  if (action.kind == Action::Kind::join) return join(action, now_ns);
  const auto found = actors_.find(action.client);
  if (found == actors_.end()) return;
  Actor& actor = *found->second.actor;
  characters_ -= actor.character_count();
  switch (action.kind) {
    case Action::Kind::join:
      break;
    case Action::Kind::leave:
    case Action::Kind::vanish:
      if (actor.counts()) --counted_clients_;
      actor.leave(action.kind == Action::Kind::leave, now_ns);
      break;
    case Action::Kind::lose_connection:
      actor.lose_connection(intended_ns, now_ns);
      break;
    case Action::Kind::dress:
      actor.dress(action.characters, plan_->stages[action.stage].levels, now_ns);
      break;
  }
  if (action.kind != Action::Kind::leave && action.kind != Action::Kind::vanish) characters_ += actor.character_count();
  maybe_gone_.push_back(action.client);
}

void Fleet::join(const Action& action, std::int64_t now_ns) {
  Member& member = actors_[action.client];
  const bool is_client = !action.misbehaviour || *action.misbehaviour == Misbehaviour::slow;
  if (is_client) {
    auto client = std::make_unique<Client>(props_, action.client, action.place, action.misbehaviour.has_value());
    Client& joining = *client;
    member.actor = std::move(client);
    joining.join(action.characters, plan_->stages[action.stage].levels, begin_ns_ + action.at_ns, now_ns);
  } else {
    member.actor = std::make_unique<Misfit>(props_, action.client, *action.misbehaviour);
  }
  if (member.actor->counts()) ++counted_clients_;
  characters_ += member.actor->character_count();
  wake(action.client, now_ns);
}

void Fleet::remove_gone() {
  for (const std::uint32_t client : std::exchange(maybe_gone_, {})) {
    const auto found = actors_.find(client);
    if (found != actors_.end() && found->second.actor->gone()) actors_.erase(found);
  }
}

std::int64_t Fleet::next_ns() const {
  std::int64_t next = queue_.empty() ? kNever_ns : queue_.top().at_ns;
  if (next_action_ < schedule_.size()) next = std::min(next, begin_ns_ + schedule_[next_action_].at_ns);
  return next;
}

void Fleet::finish(std::int64_t now_ns) {
  props_.tally->note_population(now_ns, counted_clients_, characters_);
  next_action_ = schedule_.size();
  for (auto& [client, member] : actors_) {
    member.actor->leave(true, now_ns);
    maybe_gone_.push_back(client);
  }
  counted_clients_ = characters_ = 0;
  remove_gone();
}

}  // namespace hairnet::load
