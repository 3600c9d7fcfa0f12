#include "core/world/character_touch.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include "core/assert.hpp"
#include "core/skin/skin_distance_field.hpp"
#include "core/world/character.hpp"

namespace hairnet {
namespace {

using Hand = CharacterTouch::Hand;
using MetBody = CharacterTouch::MetBody;

// How far hair may be from its design where no lattice says.
constexpr double kUnknownSway_m = 0.3;

// Only hair on a lattice that stays is moved by touch.
bool can_move(const Character& c) {
  return c.model() && c.rigid_ease_s < 0 && !c.suspended;
}

// A ball about the hair in its design, head space.
struct Ball {
  Vec3 centre = Vec3::Zero();
  double radius_m = 0;
};

Ball ball_of(const Lattice& lattice) {
  const Vec3 size =
      Vec3(lattice.dims[0] - 1, lattice.dims[1] - 1, lattice.dims[2] - 1).cwiseProduct(lattice.spacing.cast<double>());
  return {lattice.origin.cast<double>() + size / 2, size.norm() / 2};
}

// The farthest that hair gets from its design within a tick.
double sway_m(const Character& c, double tick_s) {
  if (!can_move(c)) return kUnknownSway_m;
  float farthest2_m2 = 0;
  for (const Vec3f& d : c.state.displacement) farthest2_m2 = std::max(farthest2_m2, d.squaredNorm());
  return std::sqrt(static_cast<double>(farthest2_m2)) + tick_s * static_cast<double>(c.state.speed_max_m_per_s);
}

// How near the body comes to the ball within the tick, m: at most its distance, exact for bodies that stay. Infinite
// for most bodies that are farther than `reach_m`.
double distance_m(const RoomBody& b, const Ball& ball, const Character& c, double reach_m) {
  const Vec3 from = c.from.head().point(ball.centre), to = c.to.head().point(ball.centre);
  const RigidTransform& place = b.body.place;
  const double moved_m = (to - from).norm() + (place.position - b.from.position).norm();
  const double farthest_m = reach_m + ball.radius_m + b.bounding_radius_m + moved_m;
  const bool is_far = (to - place.position).squaredNorm() > farthest_m * farthest_m;
  if (is_far && !b.body.shape.is_inside_out) return std::numeric_limits<double>::infinity();
  const Vec3 own_from = b.from.inverse().point(from), own_to = place.inverse().point(to);
  // A distance changes by at most the way. So on a way of length w no point is nearer than (d_0 + d_1 - w) / 2, where
  // d_0 and d_1 are the distances at its ends.
  const double distances_m = shape_distance(b.body.shape, own_from) + shape_distance(b.body.shape, own_to);
  return (distances_m - (own_to - own_from).norm()) / 2 - ball.radius_m;
}

// Visits the bodies that may touch the character; unless everyone may, it looks at no others.
template <class Visit>
void visit_allowed(const RoomBodies& room, const Character& c, const Visit& visit) {
  const TouchRule& rule = c.touch_rule;
  const auto visit_some = [&](std::span<const RoomBody> bodies) {
    for (const RoomBody& body : bodies) {
      if (may_touch(rule, c.owner, body.body)) visit(body);
    }
  };
  const auto visit_of = [&](ToucherId toucher) {
    visit_some(std::ranges::equal_range(room, toucher, {}, [](const RoomBody& body) { return body.body.key.toucher; }));
  };
  if (rule.audience == TouchAudience::everyone) return visit_some(room);
  visit_of(kRoomToucher);
  if (rule.audience == TouchAudience::nobody) return;
  if (c.owner != kRoomToucher) visit_of(c.owner);
  if (rule.audience == TouchAudience::oneself) return;
  ToucherId last = kRoomToucher;
  for (const ToucherId toucher : rule.chosen) {
    const bool is_again = std::exchange(last, toucher) == toucher;
    if (!is_again && toucher != c.owner) visit_of(toucher);
  }
}

// The bodies near the hair that may touch it, the nearest ones when they are too many; by key.
std::vector<const RoomBody*> near_bodies(const RoomBodies& room, double tick_s, const Character& c,
                                         TouchCounts& counts) {
  struct Near {
    double distance_m;
    const RoomBody* body;
    [[nodiscard]] auto rank() const { return std::pair(distance_m, body->body.key); }
  };
  std::vector<const RoomBody*> bodies;
  if (room.empty() || !c.levels) return bodies;
  const Level& level = c.model() ? *c.model() : c.levels->levels.front();
  if (level.rest.empty()) return bodies;
  const Ball ball = ball_of(level.geometry.lattice);
  const double coarse_m = std::max<double>(level.displacement_max_m, kUnknownSway_m) + kTouchReach_m;
  std::vector<Near> near;
  // Bodies that the rule excludes are never looked at, so they are counted by subtraction.
  counts.bodies_refused = static_cast<std::uint32_t>(room.size());
  visit_allowed(room, c, [&](const RoomBody& body) {
    --counts.bodies_refused;
    const double away_m = distance_m(body, ball, c, coarse_m);
    if (away_m <= coarse_m) near.push_back({away_m, &body});
  });
  if (near.empty()) return bodies;
  // The sway takes a pass over all nodes. The coarse bound came first, since most characters have no body near.
  const double reach_m = sway_m(c, tick_s) + kTouchReach_m;
  std::erase_if(near, [&](const Near& n) { return n.distance_m > reach_m; });
  if (near.size() > kStepBodiesMax) {
    std::ranges::sort(near, {}, &Near::rank);
    counts.bodies_left_out += static_cast<std::uint32_t>(near.size() - kStepBodiesMax);
    near.resize(kStepBodiesMax);
  }
  for (const Near& n : near) bodies.push_back(n.body);
  // Keys and not distances give the order: a body that comes nearer must not look like another body.
  std::ranges::sort(bodies, {}, [](const RoomBody* body) { return body->body.key; });
  return bodies;
}

// How far a ball is within the skin, and the way out, world.
struct Overlap {
  double depth_m = 0;
  Vec3 way_out = Vec3::Zero();
};

Overlap overlap(const Level& level, const Pose& pose, const Vec3& centre_world, double radius_m) {
  Overlap deepest;
  for (const SkinDistanceField& field : *level.skin) {
    Vec3 gradient;
    const RigidTransform& bone = pose[field.bone];
    const double depth_m = radius_m - skin_distance(field, bone.inverse().point(centre_world), &gradient);
    if (depth_m > deepest.depth_m) deepest = {depth_m, bone.vector(gradient.stableNormalized())};
  }
  return deepest;
}

// Hair between a hand and the skin would be squeezed, so a hand within the skin is moved out of it along the skin's
// normal at the deepest of three places along the hand's longest axis.
void push_out_of_skin(const Level& level, const Pose& pose, StepBody& hand) {
  Eigen::Index axis = 0;
  const double half_length_m = hand.shape.half_size_m.maxCoeff(&axis);
  Overlap deepest;
  for (const double at : {0.0, -half_length_m, half_length_m}) {
    const Overlap here = overlap(level, pose, hand.to.point(at * Vec3::Unit(axis)), hand.shape.radius_m);
    if (here.depth_m > deepest.depth_m) deepest = here;
  }
  const Vec3 shift = deepest.depth_m * deepest.way_out;
  // Both ends move alike, so the hand keeps its velocity.
  hand.from.position += shift;
  hand.to.position += shift;
}

MetBody met(const RoomBody& b, const Character& c) {
  MetBody body{b.body.key, {b.body.shape, b.from, b.body.place, kTouchFriction}};
  // A prop stays where the room has put it, also within a body, and a shape that is inside out has its surface around
  // the hair.
  const bool is_hand = b.body.key.toucher != kRoomToucher && !b.body.shape.is_inside_out;
  if (is_hand) push_out_of_skin(*c.model(), c.to, body.body);
  return body;
}

// The bodies are others than in the last tick.
bool are_others(std::span<const RoomBody* const> near, std::span<const MetBody> before) {
  const auto is_same = [](const RoomBody* a, const MetBody& b) { return a->body.key == b.key; };
  return !std::ranges::equal(near, before, is_same);
}

bool is_in_hand(const Hold& hold) {
  return !hold.is_pinned;
}

// How many hands hold hair.
std::uint32_t hand_count(const CharacterTouch& touch) {
  std::uint32_t count = 0;
  const Hold* last = nullptr;
  for (const Hold& hold : touch.holds) {
    if (hold.is_pinned) continue;
    count += !last || last->hand != hold.hand;
    last = &hold;
  }
  return count;
}

// The hand of a hold that is not pinned; follow_hands has collected it in this tick.
const Hand& hand_of(const Hold& hold, const CharacterTouch& touch) {
  const auto hand = std::ranges::find(touch.hands, hold.hand, &Hand::key);
  HAIRNET_ASSERT(hand != touch.hands.end());
  return *hand;
}

// Follows the hands that hold hair, and lets go where one has gone or may not touch any more.
void follow_hands(const RoomBodies& room, Character& c) {
  CharacterTouch& touch = *c.touch;
  std::erase_if(touch.holds, [&](const Hold& hold) {
    if (hold.is_pinned) return false;
    const RoomBody* const hand = find_body(room, hold.hand);
    return !hand || !may_touch(c.touch_rule, c.owner, hand->body);
  });
  touch.hands.clear();
  for (const Hold& hold : touch.holds) {
    if (hold.is_pinned || (!touch.hands.empty() && touch.hands.back().key == hold.hand)) continue;
    const RoomBody& body = *find_body(room, hold.hand);
    touch.hands.push_back({hold.hand, body.from, body.body.place});
  }
}

Vec3 point_head(const Character& c, std::uint32_t point) {
  const ContactPoints& contacts = c.model()->contacts;
  HAIRNET_ASSERT(point < contacts.count());
  Vec3f at = contacts.rest[point];
  for (std::uint32_t i = contacts.begin[point]; i < contacts.begin[point + 1]; ++i)
    at += contacts.weights[i] * c.state.displacement[contacts.nodes[i]];
  return at.cast<double>();
}

// Lets go of points that are too far from their anchors, and moves the anchors of those that pull too hard. `place`:
// where the hands are while the hair is as its state says.
void slip(RigidTransform Hand::*place, Character& c) {
  CharacterTouch& touch = *c.touch;
  // The stretch at which the hold's spring pulls with kHoldSlip_n.
  constexpr double kSlip_m = kHoldSlip_n / kHoldStiffness_n_per_m;
  const RigidTransform& head = c.from.head();
  const auto frame = [&](const Hold& hold) -> const RigidTransform& {
    return hold.is_pinned ? head : hand_of(hold, touch).*place;
  };
  // Leads from the point to its anchor, world.
  const auto way = [&](const Hold& hold) {
    return Vec3(frame(hold).point(hold.anchor) - head.point(point_head(c, hold.point)));
  };
  std::erase_if(touch.holds,
                [&](const Hold& hold) { return is_in_hand(hold) && !(way(hold).norm() <= kHoldStretchMax_m); });
  for (Hold& hold : touch.holds) {
    const Vec3 pull = way(hold);
    const double length_m = pull.norm();
    if (length_m <= kSlip_m) continue;
    const Vec3 slid = head.point(point_head(c, hold.point)) + kSlip_m / length_m * pull;
    hold.anchor = frame(hold).inverse().point(slid);
  }
}

void rouse(Character& c) {
  c.wake();
  // Touched hair is neither settled nor untangled, since both begin after a rest.
  c.bones_still_s = 0;
}

CharacterTouch& touch_of(Character& c) {
  if (!c.touch) c.touch = std::make_unique<CharacterTouch>();
  return *c.touch;
}

// Meets the bodies near hair on a lattice.
void feel(std::span<const RoomBody* const> near, Character& c) {
  CharacterTouch& touch = *c.touch;
  const bool is_moved = !touch.hands.empty() || std::ranges::any_of(near, &RoomBody::moves);
  if (is_moved || are_others(near, touch.bodies)) rouse(c);
  // Near a body a stride would be too coarse: the character has a turn in every tick.
  if (!near.empty() || !touch.hands.empty()) c.steps_next_tick = true;
  touch.bodies.clear();
  for (const RoomBody* body : near) touch.bodies.push_back(met(*body, c));
}

// Erases the holds for which `ends` holds.
template <class Ends>
void erase_holds(Character& c, const Ends& ends) {
  if (c.touch && std::erase_if(c.touch->holds, ends) > 0) rouse(c);
}

}  // namespace

TouchCounts meet_bodies(const RoomBodies& room, double tick_s, Character& c) {
  TouchCounts counts;
  const std::vector<const RoomBody*> near = near_bodies(room, tick_s, c, counts);
  // Most characters end here, in every tick, without an allocation.
  if (near.empty() && !c.touch) return counts;
  CharacterTouch& touch = touch_of(c);
  touch.holds_stretched = 0;
  const std::uint32_t hands = hand_count(touch);
  follow_hands(room, c);
  if (can_move(c)) {
    // A hand that has jumped is far from its hair.
    slip(&Hand::from, c);
    feel(near, c);
  }
  counts.holds_ended = hands - hand_count(touch);
  if (near.empty() && touch.holds.empty()) c.touch.reset();
  return counts;
}

void put_touch(Character& c, std::span<StepInput> inputs) {
  HAIRNET_ASSERT(c.touch);
  CharacterTouch& touch = *c.touch;
  // All substeps' bodies lie in one list, and holds in another. The spans are made after both lists are complete, since
  // a list that grows moves.
  touch.step_bodies.clear();
  touch.step_holds.clear();
  const auto step_count = static_cast<double>(inputs.size());
  for (std::size_t s = 0; s < inputs.size(); ++s) {
    const double begin = static_cast<double>(s) / step_count, end = static_cast<double>(s + 1) / step_count;
    for (const auto& [key, body] : touch.bodies) {
      touch.step_bodies.push_back(
          {body.shape, interpolate(body.from, body.to, begin), interpolate(body.from, body.to, end), body.friction});
    }
    for (const Hold& hold : touch.holds) {
      RigidTransform from = inputs[s].from.head(), to = inputs[s].to.head();
      if (!hold.is_pinned) {
        const Hand& hand = hand_of(hold, touch);
        from = interpolate(hand.from, hand.to, begin);
        to = interpolate(hand.from, hand.to, end);
      }
      touch.step_holds.push_back({hold.point, from.point(hold.anchor), to.point(hold.anchor)});
    }
  }
  touch.steps.resize(inputs.size());
  const std::size_t body_count = touch.bodies.size(), hold_count = touch.holds.size();
  for (std::size_t s = 0; s < inputs.size(); ++s) {
    touch.steps[s] = {std::span(touch.step_bodies).subspan(s * body_count, body_count),
                      std::span(touch.step_holds).subspan(s * hold_count, hold_count)};
    inputs[s].touch = &touch.steps[s];
  }
}

void slip_holds(Character& c) {
  HAIRNET_ASSERT(c.touch);
  const std::uint32_t hands = hand_count(*c.touch);
  slip(&Hand::to, c);
  c.touch->holds_stretched = hands - hand_count(*c.touch);
}

std::uint32_t take_hold(const RoomBodies& room, const Grab& grab, Character& c) {
  let_go(grab.hand, Release::drop, c);
  const RoomBody* hand = find_body(room, grab.hand);
  if (!hand || !can_move(c) || !may_touch(c.touch_rule, c.owner, hand->body)) return 0;
  struct InReach {
    double distance_m;
    std::uint32_t point;
    auto operator<=>(const InReach&) const = default;
  };
  // The hair's state is that of the tick's start.
  const RigidTransform hand_to_head = c.from.head().inverse() * hand->from;
  const RigidTransform head_to_hand = hand_to_head.inverse();
  const Vec3 place_head = hand_to_head.point(grab.place);
  std::vector<InReach> points;
  for (std::uint32_t p = 0; p < c.model()->contacts.count(); ++p) {
    const double distance_m = (point_head(c, p) - place_head).norm();
    if (distance_m <= grab.radius_m) points.push_back({distance_m, p});
  }
  if (points.empty()) return 0;
  // Who takes hold of hair that they pinned takes it along.
  erase_holds(c, [&](const Hold& hold) {
    return hold.is_pinned && hold.hand.toucher == grab.hand.toucher &&
           std::ranges::find(points, hold.point, &InReach::point) != points.end();
  });
  std::vector<Hold>& holds = touch_of(c).holds;
  std::ranges::sort(points);
  // Pins keep their places, so they count towards the limit.
  points.resize(std::min(points.size(), kStepHoldsMax - holds.size()));
  for (const InReach& p : points) holds.push_back({grab.hand, p.point, head_to_hand.point(point_head(c, p.point))});
  return static_cast<std::uint32_t>(points.size());
}

void let_go(const TouchKey& hand, Release release, Character& c) {
  switch (release) {
    case Release::drop:
      return erase_holds(c, [&](const Hold& hold) { return is_in_hand(hold) && hold.hand == hand; });
    case Release::unpin:
      return erase_holds(c, [&](const Hold& hold) {
        return hold.is_pinned && (hold.hand.toucher == hand.toucher || hand.toucher == c.owner);
      });
    case Release::pin:
      break;
  }
  if (!c.touch) return;
  for (Hold& hold : c.touch->holds) {
    if (hold.is_pinned || hold.hand != hand) continue;
    // The anchor is where the point is, so nothing pulls at first.
    hold.anchor = point_head(c, hold.point);
    hold.is_pinned = true;
  }
}

std::uint32_t held_count(const Character& c, const TouchKey& hand) {
  if (!c.touch) return 0;
  const auto is_held = [&](const Hold& hold) { return is_in_hand(hold) && hold.hand == hand; };
  return static_cast<std::uint32_t>(std::ranges::count_if(c.touch->holds, is_held));
}

void end_holds(Character& c) {
  erase_holds(c, [](const Hold&) { return true; });
}

void end_hands(Character& c) {
  erase_holds(c, is_in_hand);
}

void end_forbidden_holds(Character& c) {
  erase_holds(c, [&](const Hold& hold) { return !may_touch(c.touch_rule, c.owner, hold.hand.toucher); });
}

}  // namespace hairnet
