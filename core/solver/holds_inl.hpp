// Included once for each instruction set (Highway's foreach_target).
#if defined(HAIRNET_HOLDS_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef HAIRNET_HOLDS_INL
#undef HAIRNET_HOLDS_INL
#else
#define HAIRNET_HOLDS_INL
#endif

#include <cstddef>

#include "core/solver/step_data_inl.hpp"
#include "core/solver/touch_terms.hpp"

// Held points of one character: attachments (eq. 4) of contact points to places that move with a hand. The viscosity is
// h times the stiffness k, against the hand's motion, so the force at the end of the step is
// k (2 (a_1 - p_1) - (a_0 - p_0)) - 2 h k sum w y, with a the places and p the points if they moved rigidly.
HWY_BEFORE_NAMESPACE();
namespace hairnet {
namespace HWY_NAMESPACE {

template <class Lanes>
struct Holds : StepData<Lanes> {
  using Data = StepData<Lanes>;
  using Data::Data, Data::level, Data::m, Data::h, Data::rotation_term, Data::turned, Data::node, Data::real_at,
      Data::put;
  using typename Data::L, typename Data::Real, typename Data::Vector, typename Data::Turn;

  HWY_INLINE const float* at(std::size_t hold, std::size_t byte) const {
    return m.holds + hold * kHoldTermCount + byte / sizeof(float);
  }
  HWY_INLINE std::size_t point_of(std::size_t hold) const {
    return static_cast<std::size_t>(*at(hold, offsetof(HoldTerms, point)));
  }
  HWY_INLINE Real stiffness() const { return L::real(static_cast<float>(kHoldStiffness_n_per_m)); }
  // The part of A of each held point: h (h k + h k).
  HWY_INLINE Real coefficient() const { return L::real(2) * h * h * stiffness(); }

  HWY_INLINE Vector weighted_sum(std::size_t p, const float* nodes) const {
    const ContactPointsView& points = level.contacts;
    Vector sum = L::zero();
    for (std::size_t e = points.begin[p]; e < points.begin[p + 1]; ++e) {
      sum = L::add_scaled(L::real(points.weights[e]), node(nodes, points.nodes[e]), sum);
    }
    return sum;
  }
  HWY_INLINE void scatter(std::size_t p, const Vector& pull, float* nodes) const {
    const ContactPointsView& points = level.contacts;
    for (std::size_t e = points.begin[p]; e < points.begin[p + 1]; ++e) {
      const std::size_t j = points.nodes[e];
      put(L::add_scaled(L::real(points.weights[e]), pull, node(nodes, j)), nodes, j);
    }
  }

  // Stores the forces at y = 0 and adds them times h to m.residual, and the diagonal to m.attachment_diagonal.
  HWY_INLINE void add() {
    const Turn turn = rotation_term(offsetof(StepTerms, turn));
    const ContactPointsView& points = level.contacts;
    for (std::size_t i = 0; i < level.hold_count; ++i) {
      const std::size_t p = point_of(i);
      const Vector displacement = weighted_sum(p, m.displacement), rest = L::vector(points.rest + 3 * p);
      const Vector before = L::subtract(L::vector(at(i, offsetof(HoldTerms, from))), L::add(rest, displacement));
      const Vector after =
          L::subtract(L::vector(at(i, offsetof(HoldTerms, to))), L::add(rest, turned(turn, displacement)));
      const Vector force = L::scale(stiffness(), L::subtract(L::add(after, after), turned(turn, before)));
      put(force, m.hold_force, i);
      scatter(p, L::scale(h, force), m.residual);
      for (std::size_t e = points.begin[p]; e < points.begin[p + 1]; ++e) {
        const std::size_t j = points.nodes[e];
        const float w = points.weights[e];
        // The block is isotropic, so one number a node stands for it, as for attachments.
        put(hn::MulAdd(L::real(w * w), coefficient(), real_at(m.attachment_diagonal, j)), m.attachment_diagonal, j);
      }
    }
  }

  // Adds the holds' part of A direction to m.product. Returns their part of direction . product.
  HWY_INLINE Real multiply() {
    Vector curvature = L::zero();
    for (std::size_t i = 0; i < level.hold_count; ++i) {
      const std::size_t p = point_of(i);
      const Vector shift = weighted_sum(p, m.direction), pull = L::scale(coefficient(), shift);
      scatter(p, pull, m.product);
      curvature = L::add_products(pull, shift, curvature);
    }
    return L::sum_of(curvature);
  }

  // The energy that the hands have put into the hair, J: the work of those forces that pull it along. Without it
  // limit_elastic_energy would take the stretch that a pulling hand causes for an error of the step, and undo it.
  HWY_INLINE Real work() const {
    Real sum = L::real(0);
    for (std::size_t i = 0; i < level.hold_count; ++i) {
      const Vector y = weighted_sum(point_of(i), m.solution);
      const Vector force = L::subtract_scaled(L::real(2) * h * stiffness(), y, node(m.hold_force, i));
      sum = sum + hn::Max(h * L::dot(force, y), L::real(0));
    }
    return sum;
  }
};

}  // namespace HWY_NAMESPACE
}  // namespace hairnet
HWY_AFTER_NAMESPACE();

#endif
