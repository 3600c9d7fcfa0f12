#include "tests/whole/touching.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "schema/limits.hpp"

namespace hairnet::whole {
namespace {

// The hand has a palm and two fingers.
constexpr std::uint8_t kShapes = 3;
// Props are set and removed with these numbers.
constexpr std::uint8_t kProps = 3;

// The place of a hand that strokes hair behind a head, up and down and through it.
RigidTransform stroke(const RigidTransform& head, double time_s) {
  const Vec3 in_head(0.08 * std::sin(2.3 * time_s), -0.1 + 0.1 * std::sin(1.9 * time_s), -0.1);
  return {head.rotation, head.point(in_head)};
}

}  // namespace

std::vector<wire::ClientMessage> Touching::act(const Surroundings& around) {
  if (around.heads.empty() || around.characters.empty()) return {};
  const auto any_of = [this](const auto& list) -> const auto& {
    return list[random_.next() % list.size()];
  };
  const Head& head = any_of(around.heads);
  switch (random_.next() % 8) {
    case 0:
      at_member_ = 0;
      return {};
    case 1:
    case 2:
      at_member_ = head.member;
      has_jumped_ = true;
      return {};
    case 3:
    case 4: {
      if (at_member_ == 0) return {};
      const auto shape = static_cast<std::uint8_t>(random_.next() % kShapes);
      holds_.emplace_back(at_member_, shape);
      return {wire::TakeHold{at_member_, shape, Vec3f::Zero(), static_cast<float>(random_.between(0, 0.3))}};
    }
    case 5: {
      if (holds_.empty()) return {};
      const auto [member, shape] = any_of(holds_);
      return {wire::LetGo{member, shape, static_cast<Release>(random_.next() % 3)}};
    }
    case 6: {
      wire::SetTouch set{any_of(around.characters), static_cast<TouchAudience>(random_.next() % 4), {}};
      if (set.audience == TouchAudience::chosen) set.chosen = {1 + random_.next() % 8};
      return {std::move(set)};
    }
    default:
      if (!around.may_set_props) return {};
      return {random_props(head)};
  }
}

wire::SetProps Touching::random_props(const Head& near) {
  wire::SetProps set;
  const auto number = static_cast<std::uint8_t>(random_.next() % kProps);
  if (random_.unit() < 0.3) {
    set.removed = {number};
    return set;
  }
  const Vec3 place = near.place.position + Vec3(random_.between(-0.3, 0.3), -0.3, random_.between(-0.3, 0.3));
  const TouchShape shape = random_.unit() < 0.5 ? sphere(0.1) : capsule(0.2, 0.05);
  set.props.push_back({number, shape, {Quat::Identity(), place}, random_.unit() < 0.5});
  return set;
}

std::vector<Hand> Touching::hands(std::span<const Head> heads, double time_s) {
  const auto head = std::ranges::find(heads, at_member_, &Head::member);
  if (at_member_ == 0 || head == heads.end()) return {};
  Hand hand{0, stroke(head->place, time_s), std::exchange(has_jumped_, false)};
  hand.shapes = {{Vec3(-0.03, 0, 0), Vec3(0.03, 0, 0), 0.03},
                 {Vec3(-0.02, 0, 0), Vec3(-0.02, 0.07, 0), 0.008},
                 {Vec3(0.02, 0, 0), Vec3(0.02, 0.07, 0), 0.008}};
  return {hand};
}

std::vector<wire::ClientMessage> Touching::end(std::span<const std::uint32_t> characters, bool may_set_props) {
  at_member_ = 0;
  std::vector<wire::ClientMessage> messages;
  for (const auto& [member, shape] : holds_) {
    messages.emplace_back(wire::LetGo{member, shape, Release::drop});
    messages.emplace_back(wire::LetGo{member, shape, Release::unpin});
  }
  holds_.clear();
  for (const std::uint32_t character : characters) messages.emplace_back(wire::SetTouch{.character = character});
  if (may_set_props) {
    wire::SetProps all;
    // Others may have set props with any number.
    for (std::size_t number = 0; number < wire::kPropsMax; ++number)
      all.removed.push_back(static_cast<std::uint8_t>(number));
    messages.emplace_back(std::move(all));
  }
  return messages;
}

}  // namespace hairnet::whole
