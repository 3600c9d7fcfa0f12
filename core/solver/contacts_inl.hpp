// Included once for each instruction set (Highway's foreach_target).
#if defined(HAIRNET_CONTACTS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef HAIRNET_CONTACTS_INL
#undef HAIRNET_CONTACTS_INL
#else
#define HAIRNET_CONTACTS_INL
#endif

#include <cstddef>

#include "core/solver/bodies_inl.hpp"
#include "core/solver/contact.hpp"
#include "core/solver/skin_inl.hpp"
#include "core/solver/step_data_inl.hpp"

// Contact between hair and skin (contact.hpp), and between hair and hands or props (body_contact.hpp). The force of a
// point is evaluated where the point would end if it moved with the bone, and the stiffness acts on its motion relative
// to the bone. So a body at constant velocity adds no force. Each node gets its own part of the stiffness, by its
// weight. This is an upper bound of the true matrix, so no push overshoots. It stays in the 3x3 blocks of single nodes,
// so the iterations cost no more.
HWY_BEFORE_NAMESPACE();
namespace hairnet {
namespace HWY_NAMESPACE {

template <class Lanes>
struct Contacts : StepData<Lanes> {
  using Data = StepData<Lanes>;
  using Data::level, Data::m, Data::h, Data::term, Data::rotation_term, Data::motion_term, Data::turned,
      Data::rotated_back;
  using Data::moved, Data::squared, Data::half, Data::node, Data::block_at, Data::put, Data::Data;
  using typename Data::L, typename Data::Real, typename Data::Mask, typename Data::Vector, typename Data::Block;
  using typename Data::Motion;

  HWY_INLINE void add() {
    const Bodies<Lanes> bodies(level, m);
    for (std::size_t p = 0; p < level.contacts.count; ++p) {
      // A point's path is found once and serves all skins and bodies.
      const Path path = path_of(p);
      meet_skin(p, path);
      if (level.body_count == 0) continue;
      const Real way = hn::Sqrt(squared(L::subtract(path.ahead, path.from)));
      for (std::size_t b = 0; b < level.body_count; ++b) {
        if (bodies.is_near(b, path.from, way)) meet_body(p, path, bodies, b);
      }
    }
  }

  // The place of a contact point at the start, and where it would end with the head and by its own velocity.
  struct Path {
    Vector from, with_head, ahead;
  };
  HWY_INLINE Path path_of(std::size_t p) const {
    const ContactPointsView& points = level.contacts;
    Vector displacement = L::zero(), velocity = L::zero();
    for (std::size_t e = points.begin[p]; e < points.begin[p + 1]; ++e) {
      const Real weight = L::real(points.weights[e]);
      displacement = L::add_scaled(weight, node(m.displacement, points.nodes[e]), displacement);
      velocity = L::add_scaled(weight, node(m.velocity, points.nodes[e]), velocity);
    }
    const Vector rest = L::vector(points.rest + 3 * p);
    const Vector with_head = L::add(rest, turned(rotation_term(offsetof(StepTerms, turn)), displacement));
    return {L::add(rest, displacement), with_head, L::add_scaled(h, velocity, with_head)};
  }

  HWY_INLINE void meet_skin(std::size_t p, const Path& path) {
    for (std::size_t f = 0; f < level.skin_count; ++f) {
      const SkinDistanceFieldView& field = level.skin[f];
      if (field.limit[p] <= kContactNever_m) continue;
      const std::size_t bone = field.bone * sizeof(StepTerms::AffineMap);
      const Motion to_bone = motion_term(offsetof(StepTerms, to_bone) + bone);
      // All other quantities are in the head's axes already.
      const bool is_head = field.bone == 0;
      const Vector from =
          is_head ? path.from : moved(motion_term(offsetof(StepTerms, to_bone_before) + bone), path.from);
      const Vector travel = L::subtract(is_head ? path.ahead : moved(to_bone, path.ahead), from);
      const Real reach = hn::Sqrt(squared(travel)), limit = L::real(field.limit[p]), none = L::real(0);
      // Two tests of rising cost: most points are far from most skins, and one look at the nearest node says so for all
      // lanes at once. The full distance takes eight gathers.
      if (hn::AllFalse(L::d, hn::Lt(Skin<Lanes>::distance_min(field, from), limit + reach))) continue;
      const typename Skin<Lanes>::SkinSample skin = Skin<Lanes>::at(field, from);
      if (hn::AllFalse(L::d, hn::Lt(skin.distance, limit + reach))) continue;

      const Real depth = limit - skin.distance, depth_ahead = depth - L::dot(skin.normal, travel);
      const Mask is_in = hn::Gt(depth, none);
      Mask meets = hn::Or(is_in, hn::Gt(depth_ahead, none));
      if (hn::AllFalse(L::d, meets)) continue;
      // A round body curves away from its tangent plane: the point meets the skin only if a distance on its way says
      // so.
      const Real nearest = hn::Min(Skin<Lanes>::at(field, L::add_scaled(half(), travel, from)).distance,
                                   Skin<Lanes>::at(field, L::add(travel, from)).distance);
      meets = hn::Or(is_in, hn::And(meets, hn::Lt(nearest, limit)));

      const Real k = stiffness(p, meets, depth, depth_ahead), push = push_of(p, k, is_in, depth);
      const Real against =
          L::dot(skin.normal, L::subtract(is_head ? path.with_head : moved(to_bone, path.with_head), from));
      // The force returns to the head's axes, in which the whole system is written.
      const Vector normal = is_head ? skin.normal : rotated_back(to_bone.turn, skin.normal);
      give_contact(p, L::scale(h * hn::NegMulAdd(k, against, push), normal),
                   L::scale(h * h * k * weight_of(p), L::square(normal)));
    }
  }

  HWY_INLINE void meet_body(std::size_t p, const Path& path, const Bodies<Lanes>& bodies, std::size_t b) {
    const Motion to_body = bodies.motion_of(b, offsetof(BodyTerms, to_body));
    const Vector from = moved(bodies.motion_of(b, offsetof(BodyTerms, to_body_before)), path.from);
    const Vector travel = L::subtract(moved(to_body, path.ahead), from);
    const typename Bodies<Lanes>::Sample surface = bodies.sample(b, from);
    const Real none = L::real(0), depth = L::real(static_cast<float>(kTouchReach_m)) - surface.distance;
    const Real way_out = L::dot(surface.normal, travel), depth_ahead = depth - way_out;
    const Mask is_in = hn::Gt(depth, none);
    Mask meets = hn::Or(is_in, hn::Gt(depth_ahead, none));
    if (hn::AllFalse(L::d, meets)) return;
    meets = hn::Or(is_in, hn::And(meets, bodies.comes_in(b, from, travel, none - depth)));

    const Real k = stiffness(p, meets, depth, depth_ahead), push = push_of(p, k, is_in, depth);
    const Vector along = L::subtract_scaled(way_out, surface.normal, travel);
    const Real speed = hn::Max(hn::Sqrt(squared(along)) / h, L::real(static_cast<float>(kTouchFrictionSpeed_m_per_s)));
    // Friction over the motion of the step, as a stiffness: N s/m over h. The push was limited to
    // kContactRecovery_m_per_s before, and so is the friction that it gives.
    const Real rub =
        hn::IfThenElseZero(meets, bodies.real_of(b, offsetof(BodyTerms, friction)) * hn::Max(push, none) / (speed * h));
    const Vector against = L::subtract(moved(to_body, path.with_head), from);
    // The stiffness is rub I + (k - rub) n n^T: `rub` along the surface, k across it.
    const Real more = k - rub;
    const Vector force = L::subtract_scaled(
        rub, against, L::scale(hn::NegMulAdd(more, L::dot(surface.normal, against), push), surface.normal));
    const Vector normal = rotated_back(to_body.turn, surface.normal);
    give_contact(p, L::scale(h, rotated_back(to_body.turn, force)),
                 L::scale(h * h * weight_of(p), L::add_diagonal(rub, L::scale(more, L::square(normal)))));
  }

  // The three parts of contact_law() (contact.hpp): kContactSlope U, the stiffness, which is 0 where nothing meets, and
  // the force along the normal.
  HWY_INLINE Real slope_of(std::size_t p) const {
    return term(offsetof(StepTerms, contact)) *
           L::real(static_cast<float>(kContactSlope) * level.contacts.potential[p]);
  }
  HWY_INLINE Real stiffness(std::size_t p, Mask meets, Real depth, Real depth_ahead) const {
    const Real none = L::real(0);
    return hn::IfThenElseZero(meets, slope_of(p) * hn::Min(hn::Max(hn::Max(depth, depth_ahead), none),
                                                           L::real(static_cast<float>(kContactStiffnessDepth_m))));
  }
  HWY_INLINE Real push_of(std::size_t p, Real k, Mask is_in, Real depth) const {
    const Real recovery = k * (h * L::real(static_cast<float>(kContactRecovery_m_per_s)));
    return hn::IfThenElse(is_in, hn::Min(half() * slope_of(p) * depth * depth, recovery), k * depth);
  }
  // The true matrix has w_i w_j k between the nodes i and j. Block j has the sum of its row instead, w_j k sum_i w_i:
  // the result is block diagonal and never less than the true matrix.
  HWY_INLINE Real weight_of(std::size_t p) const {
    const ContactPointsView& points = level.contacts;
    float sum = 0;
    for (std::size_t e = points.begin[p]; e < points.begin[p + 1]; ++e) sum += points.weights[e];
    return L::real(sum);
  }
  HWY_INLINE void give_contact(std::size_t p, const Vector& pushed, const Block& block) {
    const ContactPointsView& points = level.contacts;
    for (std::size_t e = points.begin[p]; e < points.begin[p + 1]; ++e) {
      const std::size_t j = points.nodes[e];
      const Real weight = L::real(points.weights[e]);
      put(L::add_scaled(weight, pushed, node(m.residual, j)), m.residual, j);
      put(L::add_scaled(weight, block, block_at(m.diagonal, j)), m.diagonal, j);
      // The preconditioner has all of contact, since it lies in the blocks of single nodes.
      put(L::add_scaled(weight, block, block_at(m.preconditioner, j)), m.preconditioner, j);
    }
  }
};

}  // namespace HWY_NAMESPACE
}  // namespace hairnet
HWY_AFTER_NAMESPACE();

#endif
