#include "core/world/character_touch.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>

#include "core/assert.hpp"
#include "core/skin/skin_distance_field.hpp"
#include "core/world/character.hpp"

namespace hairnet {
namespace {

using Hand = CharacterTouch::Hand;
using MetBody = CharacterTouch::MetBody;

// How far hair may be from its design when the character has no lattice that moves.
constexpr double kUnknownSway_m = 0.3;

// Whether touch can move the hair: it must be on a lattice that does not ease to the rigid level, of a character with
// turns.
bool can_move(const Character& c) {
  return c.model() && c.rigid_ease_s < 0 && !c.suspended;
}

// A ball about the hair in its design, head space.
struct Ball {
  Vec3 centre = Vec3::Zero();
  double radius_m = 0;
};

// The ball about the lattice's box.
Ball ball_of(const Lattice& lattice) {
  const Vec3 size =
      Vec3(lattice.dims[0] - 1, lattice.dims[1] - 1, lattice.dims[2] - 1).cwiseProduct(lattice.spacing.cast<double>());
  return {lattice.origin.cast<double>() + size / 2, size.norm() / 2};
}

// The farthest that hair gets from its design within a tick, m.
double sway_m(const Character& c, double tick_s) {
  if (!can_move(c)) return kUnknownSway_m;
  float farthest2_m2 = 0;
  for (const Vec3f& d : c.state.displacement) farthest2_m2 = std::max(farthest2_m2, d.squaredNorm());
  return std::sqrt(static_cast<double>(farthest2_m2)) + tick_s * static_cast<double>(c.state.speed_max_m_per_s);
}

// The ball's centre in the world at the start of the tick and at its end, m.
struct Way {
  Vec3 from, to;
};

// Whether the body is surely farther than `reach_m` from the ball all through the tick: a quick test that most bodies
// pass.
bool is_far(const RoomBody& b, const Ball& ball, const Way& way, double reach_m) {
  if (b.body.shape.is_inside_out) return false;
  const double moved_m = (way.to - way.from).norm() + (b.body.place.position - b.from.position).norm();
  const double farthest_m = reach_m + ball.radius_m + b.bounding_radius_m + moved_m;
  return (way.to - b.body.place.position).squaredNorm() > farthest_m * farthest_m;
}

// A lower bound of the distance between the body and the ball within the tick, m; exact for bodies that stay.
double distance_m(const RoomBody& b, const Ball& ball, const Way& way) {
  const Vec3 own_from = b.from.inverse().point(way.from), own_to = b.body.place.inverse().point(way.to);
  // A distance changes by at most the way that is travelled. So on a way of length w no point is nearer than (d_0 + d_1
  // - w) / 2, where d_0 and d_1 are the distances at its ends.
  const double distances_m = shape_distance(b.body.shape, own_from) + shape_distance(b.body.shape, own_to);
  return (distances_m - (own_to - own_from).norm()) / 2 - ball.radius_m;
}

// Visits the bodies that may touch the character. Bodies ascend by toucher, so unless everyone may touch, only the runs
// of the allowed touchers are visited.
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
  // The same toucher may stand twice in `chosen`, which ascends.
  ToucherId last = kRoomToucher;
  for (const ToucherId toucher : rule.chosen) {
    const bool is_again = std::exchange(last, toucher) == toucher;
    if (!is_again && toucher != c.owner) visit_of(toucher);
  }
}

// The bodies near the hair that may touch it, ascending by key. When there are more than kStepBodiesMax, only the
// nearest ones. The pointers lead into `room`.
std::vector<const RoomBody*> near_bodies(const RoomBodies& room, double tick_s, const Character& c,
                                         TouchCounts& counts) {
  struct Near {
    double distance_m;
    const RoomBody* body;
    [[nodiscard]] auto rank() const { return std::pair(distance_m, body->body.key); }
  };
  std::vector<const RoomBody*> bodies;
  if (room.empty() || !c.levels) return bodies;
  // Hair without a lattice has the box of the finest level's.
  const Level& level = c.model() ? *c.model() : c.levels->levels.front();
  if (level.rest.empty()) return bodies;
  const Ball ball = ball_of(level.geometry.lattice);
  const Way way{c.from.head().point(ball.centre), c.to.head().point(ball.centre)};
  const double coarse_m = std::max<double>(level.displacement_max_m, kUnknownSway_m) + kTouchReach_m;
  // The exact reach takes a pass over all nodes. Most characters have no body within the coarse one.
  std::optional<double> reach_m;
  std::vector<Near> near;
  // Bodies that the rule excludes are never looked at, so they are counted by subtraction.
  counts.bodies_refused = static_cast<std::uint32_t>(room.size());
  visit_allowed(room, c, [&](const RoomBody& body) {
    --counts.bodies_refused;
    if (is_far(body, ball, way, coarse_m)) return;
    if (!reach_m) reach_m = sway_m(c, tick_s) + kTouchReach_m;
    if (is_far(body, ball, way, *reach_m)) return;
    const double away_m = distance_m(body, ball, way);
    if (away_m <= *reach_m) near.push_back({away_m, &body});
  });
  if (near.size() > kStepBodiesMax) {
    std::ranges::sort(near, {}, &Near::rank);
    counts.bodies_left_out += static_cast<std::uint32_t>(near.size() - kStepBodiesMax);
    near.resize(kStepBodiesMax);
  }
  for (const Near& n : near) bodies.push_back(n.body);
  // The order is that of keys and not of distances: are_others() would take a body that comes nearer for another one.
  std::ranges::sort(bodies, {}, [](const RoomBody* body) { return body->body.key; });
  return bodies;
}

// How deep a ball is in the skin, and the way out of it, of unit length, world.
struct Overlap {
  double depth_m = 0;
  Vec3 way_out = Vec3::Zero();
};

// The deepest overlap of a ball with the skins of all bones.
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

// Moves a hand that is within the skin out of it, because hair in between would be squeezed. The way out is the skin's
// normal at the deepest of three places: the middle of the hand's longest axis, and its ends.
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

// The body as the character's hair meets it in this tick.
MetBody met(const RoomBody& b, const Character& c) {
  MetBody body{b.body.key, {b.body.shape, b.from, b.body.place, kTouchFriction}};
  // Only a hand is pushed out of the skin. A prop stays where the room has put it, even within a body, and a shape that
  // is inside out has its surface around the hair.
  const bool is_hand = b.body.key.toucher != kRoomToucher && !b.body.shape.is_inside_out;
  if (is_hand) push_out_of_skin(*c.model(), c.to, body.body);
  return body;
}

// Whether the bodies are not those of the tick before, by their keys.
bool are_others(std::span<const RoomBody* const> near, std::span<const MetBody> before) {
  const auto is_same = [](const RoomBody* a, const MetBody& b) { return a->body.key == b.key; };
  return !std::ranges::equal(near, before, is_same);
}

bool is_in_hand(const Hold& hold) {
  return !hold.is_pinned;
}

// How many hands hold hair. Holds of one hand are neighbours, so each change of the key is another hand.
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

// Ends the holds of hands that have gone or may not touch any more, and collects where the other hands are in this
// tick.
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

// Where a contact point of the hair is, head space, m.
Vec3 point_head(const Character& c, std::uint32_t point) {
  const ContactPoints& contacts = c.model()->contacts;
  HAIRNET_ASSERT(point < contacts.count());
  Vec3f at = contacts.rest[point];
  for (std::uint32_t i = contacts.begin[point]; i < contacts.begin[point + 1]; ++i)
    at += contacts.weights[i] * c.state.displacement[contacts.nodes[i]];
  return at.cast<double>();
}

// Lets go of points that are too far from their anchors, and moves the anchors of points that pull too hard. `place`
// says which place of a hand belongs to the hair's state: Hand::from before the turn, Hand::to after it.
void slip(RigidTransform Hand::*place, Character& c) {
  CharacterTouch& touch = *c.touch;
  // The stretch at which the hold's spring pulls with kHoldSlip_n.
  constexpr double kSlip_m = kHoldSlip_n / kHoldStiffness_n_per_m;
  const RigidTransform& head = c.from.head();
  // The axes in which a hold's anchor is given.
  const auto frame = [&](const Hold& hold) -> const RigidTransform& {
    return hold.is_pinned ? head : hand_of(hold, touch).*place;
  };
  // The way from a held point to its anchor, world.
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

// Wakes a character whose touch has changed.
void rouse(Character& c) {
  c.wake();
  // Hair that is being touched must be neither settled nor untangled, and both begin when the bones have been still for
  // a time.
  c.bones_still_s = 0;
}

// The character's CharacterTouch, which this makes where there is none.
CharacterTouch& touch_of(Character& c) {
  if (!c.touch) c.touch = std::make_unique<CharacterTouch>();
  return *c.touch;
}

// Gives the character the bodies near its hair.
void feel(std::span<const RoomBody* const> near, Character& c) {
  CharacterTouch& touch = *c.touch;
  const bool is_moved = !touch.hands.empty() || std::ranges::any_of(near, &RoomBody::moves);
  if (is_moved || are_others(near, touch.bodies)) rouse(c);
  // Near a body a stride of several ticks would be too coarse, so the character has a turn in every tick.
  if (!near.empty() || !touch.hands.empty()) c.steps_next_tick = true;
  touch.bodies.clear();
  for (const RoomBody* body : near) touch.bodies.push_back(met(*body, c));
}

// Erases the holds for which `ends` is true, and wakes the character if there are any.
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
    // A hand may have jumped since the last tick, and is then too far from the hair that it holds.
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
  // The hair's state is that of the tick's start, so the hand's place at the start belongs to it.
  const RigidTransform hand_to_head = c.from.head().inverse() * hand->from;
  const RigidTransform head_to_hand = hand_to_head.inverse();
  const Vec3 place_head = hand_to_head.point(grab.place);
  std::vector<InReach> points;
  for (std::uint32_t p = 0; p < c.model()->contacts.count(); ++p) {
    const double distance_m = (point_head(c, p) - place_head).norm();
    if (distance_m <= grab.radius_m) points.push_back({distance_m, p});
  }
  if (points.empty()) return 0;
  // A person who takes hold of hair that they pinned takes it along.
  erase_holds(c, [&](const Hold& hold) {
    return hold.is_pinned && hold.hand.toucher == grab.hand.toucher &&
           std::ranges::find(points, hold.point, &InReach::point) != points.end();
  });
  std::vector<Hold>& holds = touch_of(c).holds;
  std::ranges::sort(points);
  // Pins keep their places, so the new holds get only what the pins leave of kStepHoldsMax.
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
    // The anchor is put where the point is, so the pin pulls at nothing at first.
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
