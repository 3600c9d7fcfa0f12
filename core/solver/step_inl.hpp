// Included once for each instruction set (Highway's foreach_target).
#if defined(HAIRNET_STEP_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef HAIRNET_STEP_INL
#undef HAIRNET_STEP_INL
#else
#define HAIRNET_STEP_INL
#endif

#include <cstddef>

#include "core/solver/contacts_inl.hpp"
#include "core/solver/damping.hpp"
#include "core/solver/holds_inl.hpp"
#include "core/solver/spring.hpp"
#include "core/solver/step_data_inl.hpp"

// One step of the lattices in one layout (`Lanes`: a crowd or a single character). step.hpp states the system that it
// solves and why it is stable; reference_step.cpp has the same forces in double.
HWY_BEFORE_NAMESPACE();
namespace hairnet {
namespace HWY_NAMESPACE {

template <class Lanes>
struct Step : StepData<Lanes> {
  using Data = StepData<Lanes>;
  using Data::block_at, Data::put, Data::Data;
  using Data::kVector, Data::level, Data::m, Data::h, Data::term, Data::vector_term, Data::rotation_term;
  using Data::motion_term, Data::turned, Data::moved, Data::squared, Data::half, Data::node, Data::real_at;
  using typename Data::L, typename Data::Real, typename Data::Mask, typename Data::Vector, typename Data::Block;
  using typename Data::Turn, typename Data::Motion;

  // Steps all lanes: m.displacement and m.velocity are the states at the start, and afterwards at the end.
  HWY_INLINE void run(int iterations) {
    // The limit may change the displacements, so it comes before all that reads them, and leaves springs and
    // attachments measured. From rotate_state on, every vector is in the axes of the head at the end of the step.
    // precondition inverts what all forces have added to the diagonal, so it comes after them.
    limit_elastic_energy();
    rotate_state();
    add_node_forces();
    Contacts<Lanes>(level, m).add();
    add_springs();
    add_attachments();
    if (has_holds()) Holds<Lanes>(level, m).add();
    if (level.wind_fraction) add_wind();
    precondition();
    advance(solve(iterations));
  }

  // Whether a hand holds hair. Such characters are stepped alone (crowd_step.cpp), since few are held, and each at
  // points of its own.
  HWY_INLINE bool has_holds() const {
    if constexpr (L::kIsCrowd) return false;
    return level.hold_count > 0;
  }

  // Most stiffeners have the eight nodes of one cell: loops over these are unrolled.
  static constexpr std::size_t kCellNodes = 8;
  static HWY_INLINE bool is_in_cell(const StiffenerView& stiffeners, std::size_t s) {
    return stiffeners.begin[s + 1] - stiffeners.begin[s] == kCellNodes;
  }

  // sum_j w_j nodes_j of stiffener s
  static HWY_INLINE Vector weighted_sum(const StiffenerView& stiffeners, std::size_t s, const float* nodes) {
    const std::size_t begin = stiffeners.begin[s], end = stiffeners.begin[s + 1];
    // Weights belong to the level and are broadcast to all lanes; nothing but distances to the skin is gathered across
    // lanes.
    const auto weighted = [&](std::size_t e, const Vector& sum) HWY_ATTR {
      return L::add_scaled(L::real(stiffeners.weights[e]), node(nodes, stiffeners.nodes[e]), sum);
    };
    Vector sum = L::scale(L::real(stiffeners.weights[begin]), node(nodes, stiffeners.nodes[begin]));
    if (is_in_cell(stiffeners, s)) {
      for (std::size_t j = 1; j < kCellNodes; ++j) sum = weighted(begin + j, sum);
    } else {
      for (std::size_t e = begin + 1; e < end; ++e) sum = weighted(e, sum);
    }
    return sum;
  }
  // nodes_j += w_j sigma
  static HWY_INLINE void scatter(const StiffenerView& stiffeners, std::size_t s, const Vector& sigma, float* nodes) {
    const std::size_t begin = stiffeners.begin[s], end = stiffeners.begin[s + 1];
    const auto give = [&](std::size_t e) HWY_ATTR {
      const std::size_t j = stiffeners.nodes[e];
      put(L::add_scaled(L::real(stiffeners.weights[e]), sigma, node(nodes, j)), nodes, j);
    };
    if (is_in_cell(stiffeners, s)) {
      for (std::size_t j = 0; j < kCellNodes; ++j) give(begin + j);
    } else {
      for (std::size_t e = begin; e < end; ++e) give(e);
    }
  }
  // nodes_j += w_j^2 block
  static HWY_INLINE void scatter_block(const StiffenerView& stiffeners, std::size_t s, const Block& block,
                                       float* nodes) {
    for (std::size_t e = stiffeners.begin[s]; e < stiffeners.begin[s + 1]; ++e) {
      const std::size_t j = stiffeners.nodes[e];
      const float w = stiffeners.weights[e];
      put(L::add_scaled(L::real(w * w), block, block_at(nodes, j)), nodes, j);
    }
  }

  HWY_INLINE Real node_mass(std::size_t i) const { return term(offsetof(StepTerms, density)) * L::real(level.mass[i]); }
  // The stiffness that levels/ether.hpp has built replaces the tension of hanging hair, so it grows with the hair's
  // mass, as gel does.
  HWY_INLINE Real ether_stiffness(std::size_t i) const {
    return term(offsetof(StepTerms, density)) *
           hn::MulAdd(term(offsetof(StepTerms, gel_per_s2)), L::real(level.mass[i]), L::real(level.ether_stiffness[i]));
  }
  // Does for all lanes what solver_damping() of damping.hpp does.
  HWY_INLINE Real solver_damping(Real k, Real q) const {
    const Real numerical = h * k;
    return hn::Max(q - numerical, L::real(-static_cast<float>(kNumericalDampingShare)) * numerical);
  }
  // A stiffness, N/m, and the damping that the solver uses for it, N s/m.
  struct Law {
    Real k, q;
  };
  HWY_INLINE Law ether_law(std::size_t i) const {
    const Real k = ether_stiffness(i);
    const Real q =
        term(offsetof(StepTerms, density)) * term(offsetof(StepTerms, ether_damping)) * L::real(level.ether_damping[i]);
    return {k, solver_damping(k, q)};
  }
  HWY_INLINE Law law(const StiffenerView& stiffeners, std::size_t s) const {
    const Real k = term(offsetof(StepTerms, stiffness)) * L::real(stiffeners.stiffness[s]);
    return {k, solver_damping(k, term(offsetof(StepTerms, damping)) * L::real(stiffeners.damping[s]))};
  }
  HWY_INLINE Block drag(std::size_t i) const {
    return L::scale(term(offsetof(StepTerms, air_drag)), L::block(level.drag + 6 * i));
  }

  // Measures springs and attachments in head space: |eps| - |eps_0| with the direction of eps, and eps - eps_0.
  HWY_INLINE void measure() {
    const Real none = L::real(0);
    for (std::size_t s = 0; s < level.springs.count; ++s) {
      const Vector delta = weighted_sum(level.springs, s, m.displacement);
      const Vector rest = L::vector(level.springs.rest + 3 * s);
      const Vector eps = L::add(rest, delta);
      const Real length = hn::Sqrt(squared(eps)), rest_length = L::real(level.springs.rest_length[s]);
      const Real both = length + rest_length, by = L::real(1) / (length * both);
      // A spring of zero length has no direction, and no force until it has one.
      const Mask has_length = length > none;
      put(L::scale(hn::IfThenElse(has_length, both * by, none), eps), m.spring_direction, s);
      // |eps_0 + delta| - |eps_0| without cancellation: exactly 0 for delta = 0.
      const Real change = L::dot(L::add(L::add(rest, rest), delta), delta) * (length * by);
      const Real elongation = hn::IfThenElse(has_length, change, none - rest_length);
      put(elongation, m.spring_elongation, s);
      put(branch_change(s, elongation), m.spring_change, s);
    }
    for (std::size_t s = 0; s < level.attachments.count; ++s) {
      put(weighted_sum(level.attachments, s, m.displacement), m.attachment_displacement, s);
    }
  }

  // SpringBranch (spring.hpp) of a spring of this elongation: its change, and from a change, its elongation beyond the
  // limit.
  HWY_INLINE Real branch_change(std::size_t s, Real elongation) const {
    const Real strain = elongation / L::real(level.springs.rest_length[s]), none = L::real(0);
    const Real softer = hn::IfThenElse(hn::Lt(strain, L::real(static_cast<float>(-kBucklingStrain))),
                                       L::real(static_cast<float>(-kBuckling)), none);
    return hn::IfThenElse(hn::Gt(strain, L::real(static_cast<float>(kStiffStrain))),
                          L::real(static_cast<float>(kStiffening)), softer);
  }
  HWY_INLINE Real beyond_branch(std::size_t s, Real change, Real elongation) const {
    const Real strain = hn::IfThenElse(hn::Gt(change, L::real(0)), L::real(static_cast<float>(kStiffStrain)),
                                       L::real(static_cast<float>(-kBucklingStrain)));
    return hn::NegMulAdd(strain, L::real(level.springs.rest_length[s]), elongation);
  }

  // The energy of the measured springs, on their stored branches, of the measured attachments, and of the ether, J.
  HWY_INLINE Real elastic_energy() const {
    Real springs = L::real(0), ether = L::real(0);
    Vector attachments = L::zero();
    for (std::size_t s = 0; s < level.springs.count; ++s) {
      const Real elongation = real_at(m.spring_elongation, s), change = real_at(m.spring_change, s);
      const Real beyond = beyond_branch(s, change, elongation);
      const Real square = hn::MulAdd(change * beyond, beyond, elongation * elongation);
      springs = hn::MulAdd(L::real(level.springs.stiffness[s]), square, springs);
    }
    for (std::size_t s = 0; s < level.attachments.count; ++s) {
      const Vector shift = node(m.attachment_displacement, s);
      attachments = L::add_products(L::scale(L::real(level.attachments.stiffness[s]), shift), shift, attachments);
    }
    for (std::size_t i = 0; i < level.node_count; ++i) {
      ether = hn::MulAdd(ether_stiffness(i), squared(node(m.displacement, i)), ether);
    }
    return half() * hn::MulAdd(term(offsetof(StepTerms, stiffness)), springs + L::sum_of(attachments), ether);
  }

  // Scales a lattice with more elastic energy than its last step may have left down towards its design, in up to kDraws
  // draws. This rarely happens in ordinary motion. Afterwards `measure` has run for the state that the step starts
  // from.
  HWY_INLINE void limit_elastic_energy() {
    // The limit is a little larger than the stored one, so that rounding in the sums of the last step does not look
    // like an excess. One draw takes at most half of a displacement, since the energy of springs that turn is not
    // quadratic in it.
    constexpr float kRounding = 1e-3f, kRounding_j = 1e-12f, kDrawMin = 0.5f;
    constexpr int kDraws = 20;
    measure();
    const Real most =
        hn::MulAdd(term(offsetof(StepTerms, elastic_energy_max_j)), L::real(1 + kRounding), L::real(kRounding_j));
    for (int draw = 1; draw <= kDraws; ++draw) {
      const Real energy = elastic_energy();
      const Mask is_over = energy > most;
      if (hn::AllFalse(L::d, is_over)) return;
      // The energy of springs that have hardly turned is proportional to the square of the displacement. The factor
      // 0.999 makes one draw enough for them in spite of rounding.
      Real by = hn::Max(L::real(kDrawMin), L::real(0.999f) * hn::Sqrt(most / energy));
      // The design has no elastic energy, so the last draw always ends the excess.
      if (draw == kDraws) by = L::real(0);
      by = hn::IfThenElse(is_over, by, L::real(1));
      for (std::size_t i = 0; i < level.node_count; ++i) {
        put(L::scale(by, node(m.displacement, i)), m.displacement, i);
      }
      measure();
    }
  }

  // Rotates into the head's new axes: R d, R v - R' P^0 (m.velocity from here on) and the rest's velocity R' P^0.
  HWY_INLINE void rotate_state() {
    const Turn turn = rotation_term(offsetof(StepTerms, turn));
    const Motion rigid_velocity = motion_term(offsetof(StepTerms, rigid_velocity));
    for (std::size_t i = 0; i < level.node_count; ++i) {
      const Vector rigid_rate = moved(rigid_velocity, L::vector(level.rest + 3 * i));
      put(rigid_rate, m.rigid_velocity, i);
      put(turned(turn, node(m.displacement, i)), m.rotated_displacement, i);
      put(L::subtract(turned(turn, node(m.velocity, i)), rigid_rate), m.velocity, i);
    }
  }

  // The forces on one node alone: its part of b, and its own block of A.
  struct NodeSystem {
    Vector load;
    Block own;
  };

  // Stores the forces on single nodes at y = 0 times h in m.residual, with the inertia M (R v - R' P^0), and the nodes'
  // own blocks of A in m.diagonal and m.preconditioner.
  HWY_INLINE void add_node_forces() {
    for (std::size_t i = 0; i < level.node_count; ++i) {
      const NodeSystem system = free_node(i);
      put(system.load, m.residual, i);
      put(system.own, m.diagonal, i);
      put(system.own, m.preconditioner, i);
      put(L::real(0), m.attachment_diagonal, i);
    }
  }

  // Inertia, ether, gravity and drag in still air.
  HWY_INLINE NodeSystem free_node(std::size_t i) const {
    const Real mass = node_mass(i);
    const Law ether = ether_law(i);
    const Block Q = drag(i);
    // At y = 0 a node moves with its rest: ether pulls by its stiffness only, and still air resists the motion of the
    // rest.
    const Vector pull =
        L::add_scaled(ether.k, node(m.rotated_displacement, i), L::multiply(Q, node(m.rigid_velocity, i)));
    const Vector force = L::subtract(L::scale(mass, vector_term(offsetof(StepTerms, gravity_load))), pull);
    return {L::add_scaled(h, force, L::scale(mass, node(m.velocity, i))),
            L::add_diagonal(hn::MulAdd(h, hn::MulAdd(h, ether.k, ether.q), mass), L::scale(h, Q))};
  }

  // The wind's part of the drag, h Q u.
  HWY_INLINE void add_wind() {
    for (std::size_t i = 0; i < level.node_count; ++i) {
      const float* at = level.wind_fraction + 3 * i;
      const Vector wind = mix(face(at, 0), face(at, 4), at[2]);
      put(L::add_scaled(h, L::multiply(drag(i), wind), node(m.residual, i)), m.residual, i);
    }
  }
  // The wind at corner c of the lattice, and, by linear interpolation, in the face of corners c to c + 3 at the
  // fractions at[0] and at[1].
  HWY_INLINE Vector corner(std::size_t c) const {
    return vector_term(offsetof(StepTerms, wind) + c * 3 * sizeof(float));
  }
  HWY_INLINE Vector face(const float* at, std::size_t c) const {
    return mix(mix(corner(c), corner(c + 1), at[0]), mix(corner(c + 2), corner(c + 3), at[0]), at[1]);
  }
  static HWY_INLINE Vector mix(const Vector& a, const Vector& b, float t) {
    return L::add_scaled(L::real(t), L::subtract(b, a), a);
  }

  // Springs at y = 0 (eq. 3): the direction at the start of the step, the elongation there and its change by the rest
  // motion over the step.
  HWY_INLINE void add_springs() {
    const Turn turn = rotation_term(offsetof(StepTerms, turn));
    const Turn rigid_rate_of =
        rotation_term(offsetof(StepTerms, rigid_velocity) + offsetof(StepTerms::AffineMap, turn));
    for (std::size_t s = 0; s < level.springs.count; ++s) {
      const Real k = term(offsetof(StepTerms, stiffness)) * L::real(level.springs.stiffness[s]);
      const Real more = real_at(m.spring_change, s) * k, stiffness = k + more;
      const Real q = solver_damping(stiffness, term(offsetof(StepTerms, damping)) * L::real(level.springs.damping[s]));
      const Vector e = turned(turn, node(m.spring_direction, s));
      const Real rigid_rate = L::dot(e, turned(rigid_rate_of, L::vector(level.springs.rest + 3 * s)));  // R' eps_0 . e
      const Real elongation = real_at(m.spring_elongation, s);
      // At y = 0 the rest's motion stretches the spring by h e.R' eps_0 within the step, at the rate e.R' eps_0. The
      // tension at the end is T(x) + (h k + q) times this rate. On the middle branch `more` is zero, so it does not
      // matter which limit beyond_branch takes.
      const Real hk_q = hn::MulAdd(h, stiffness, q), coefficient = h * hk_q;
      const Real tension =
          hn::MulAdd(hk_q, rigid_rate, hn::MulAdd(more, beyond_branch(s, more, elongation), k * elongation));
      put(e, m.spring_direction, s);
      put(hn::MulAdd(h, rigid_rate, elongation), m.spring_elongation, s);
      put(coefficient, m.spring_coefficient, s);
      scatter(level.springs, s, L::scale(L::real(0) - h * tension, e), m.residual);
      scatter_block(level.springs, s, L::scale(coefficient, L::square(e)), m.preconditioner);
    }
  }

  // Attachments at y = 0 (eq. 4).
  HWY_INLINE void add_attachments() {
    const Turn turn = rotation_term(offsetof(StepTerms, turn));
    for (std::size_t s = 0; s < level.attachments.count; ++s) {
      const Law attachment = law(level.attachments, s);
      // Viscosity acts on y alone: the head's own motion does not stretch an attachment, so hair does not lag behind a
      // steady head.
      const Real coefficient = h * hn::MulAdd(h, attachment.k, attachment.q);
      put(coefficient, m.attachment_coefficient, s);
      const Vector pull = turned(turn, node(m.attachment_displacement, s));
      scatter(level.attachments, s, L::scale(L::real(0) - h * attachment.k, pull), m.residual);
      for (std::size_t e = level.attachments.begin[s]; e < level.attachments.begin[s + 1]; ++e) {
        const std::size_t j = level.attachments.nodes[e];
        const float w = level.attachments.weights[e];
        put(hn::MulAdd(L::real(w * w), coefficient, real_at(m.attachment_diagonal, j)), m.attachment_diagonal, j);
      }
    }
  }

  // Inverses of A's 3x3 diagonal blocks. Other preconditioners are not worth their code. At equal error they divide the
  // number of multiply-adds by 1.04-1.20 (lines of vertically adjacent nodes), 1.06-1.12 (coloured Gauss-Seidel), at
  // most 1.2 (a constant factor that all characters share), 0.5-0.8 (incomplete Cholesky) or less than 1 (Chebyshev,
  // two grids).
  HWY_INLINE void precondition() {
    for (std::size_t i = 0; i < level.node_count; ++i) {
      const Block whole = L::add_diagonal(real_at(m.attachment_diagonal, i), block_at(m.preconditioner, i));
      put(L::inverse(whole), m.preconditioner, i);
    }
  }

  // product = A direction, computed from the stiffeners: the matrix is never assembled (paper 2.2). Before that,
  // the solution goes `alpha` along the old direction, and direction = preconditioned + beta direction. Returns
  // direction . product.
  HWY_INLINE Real multiply(Real alpha, Real beta) {
    // The updates of solution and direction share one pass over the nodes, as a crowd waits for memory and not for
    // arithmetic.
    Vector own = L::zero();
    for (std::size_t i = 0; i < level.node_count; ++i) {
      const Vector old = node(m.direction, i);
      put(L::add_scaled(alpha, old, node(m.solution, i)), m.solution, i);
      const Vector direction = L::add_scaled(beta, old, node(m.preconditioned, i));
      put(direction, m.direction, i);
      if constexpr (!L::kIsCrowd) own = put_own_product(direction, i, own);
    }
    const Real of_springs = pull_springs(), of_attachments = pull_attachments();
    if constexpr (L::kIsCrowd) own = collect_pulls();
    Real curvature = L::sum_of(own) + of_springs + of_attachments;
    if (has_holds()) curvature = curvature + Holds<Lanes>(level, m).multiply();
    return curvature;
  }

  // Adds a stiffener's force to its nodes. A single character adds it directly. A crowd is limited by memory traffic:
  // it stores the force once for each stiffener, and each node sums its own forces (collect_pulls), which halves the
  // traffic; adding to eight nodes is 12 % slower there.
  HWY_INLINE void give_pull(const StiffenerView& stiffeners, std::size_t s, const Vector& pull, float* pulls) {
    if constexpr (L::kIsCrowd) {
      put(pull, pulls, s);
    } else {
      scatter(stiffeners, s, pull, m.product);
    }
  }
  // Adds the springs' part of A direction, and in pull_attachments the attachments'. Each returns its part of direction
  // . product.
  HWY_INLINE Real pull_springs() {
    Real curvature = L::real(0);
    for (std::size_t s = 0; s < level.springs.count; ++s) {
      const Vector e = node(m.spring_direction, s);
      const Real stretch = L::dot(e, weighted_sum(level.springs, s, m.direction));
      const Real tension = real_at(m.spring_coefficient, s) * stretch;
      give_pull(level.springs, s, L::scale(tension, e), m.pull);
      curvature = hn::MulAdd(tension, stretch, curvature);
    }
    return curvature;
  }
  HWY_INLINE Real pull_attachments() {
    Vector curvature = L::zero();
    for (std::size_t s = 0; s < level.attachments.count; ++s) {
      const Vector shift = weighted_sum(level.attachments, s, m.direction);
      const Vector pull = L::scale(real_at(m.attachment_coefficient, s), shift);
      give_pull(level.attachments, s, pull, m.pull + level.springs.count * kVector);
      curvature = L::add_products(pull, shift, curvature);
    }
    return L::sum_of(curvature);
  }
  // Stores a node's own part of A direction, and adds its part of direction . product to `own`.
  HWY_INLINE Vector put_own_product(const Vector& direction, std::size_t i, const Vector& own) {
    const Vector product = L::multiply(block_at(m.diagonal, i), direction);
    put(product, m.product, i);
    return L::add_products(direction, product, own);
  }
  // Sums each node's own part and the stored forces of its stiffeners into m.product. Returns the nodes' own part of
  // direction . product.
  HWY_INLINE Vector collect_pulls() {
    const IncidenceView& incidences = level.incidences;
    Vector own = L::zero();
    for (std::size_t i = 0; i < level.node_count; ++i) {
      const Vector direction = node(m.direction, i);
      Vector product = L::multiply(block_at(m.diagonal, i), direction);
      own = L::add_products(direction, product, own);
      for (std::size_t e = incidences.begin[i]; e < incidences.begin[i + 1]; ++e) {
        product = L::add_scaled(L::real(incidences.weights[e]), node(m.pull, incidences.stiffeners[e]), product);
      }
      put(product, m.product, i);
    }
    return own;
  }

  // Updates the residual for the new solution. Returns residual . preconditioned.
  HWY_INLINE Real update_residual(Real alpha) {
    Vector rho = L::zero();
    for (std::size_t i = 0; i < level.node_count; ++i) {
      const Vector residual = L::subtract_scaled(alpha, node(m.product, i), node(m.residual, i));
      const Vector preconditioned = L::multiply(block_at(m.preconditioner, i), residual);
      put(residual, m.residual, i);
      put(preconditioned, m.preconditioned, i);
      rho = L::add_products(residual, preconditioned, rho);
    }
    return L::sum_of(rho);
  }

  struct Solved {
    // The product y.b, J.
    Real work;
    // The last residual . preconditioned. It is a finite number only if all numbers of the solve are.
    Real rho;
  };

  // Conjugate gradient from y = 0; m.residual contains the right-hand side on entry. A character that has converged, or
  // whose system is broken, stays unchanged while the iteration continues for the other lanes.
  HWY_INLINE Solved solve(int iterations) {
    const Real none = L::real(0);
    for (std::size_t i = 0; i < level.node_count; ++i) {
      for (float* nodes : {m.solution, m.direction, m.product}) put(L::zero(), nodes, i);
    }
    Real rho = update_residual(none), work = none, alpha = none, beta = none;
    // A residual that is smaller by this factor is the rounding error of float, so more iterations would gain nothing.
    const Real enough = L::real(1e-12f) * rho;
    Mask goes_on = rho > none;
    for (int iteration = 0; iteration < iterations && !hn::AllFalse(L::d, goes_on); ++iteration) {
      const Real curvature = multiply(alpha, beta);
      // A NaN compares as false, so a broken lane stops here. Its rho becomes NaN, which `advance` reports.
      goes_on = hn::And(goes_on, curvature > none);
      alpha = hn::IfThenElseZero(goes_on, rho / curvature);
      // The product b.direction is rho, as the part that b has lost so far is conjugate to the direction.
      work = hn::MulAdd(alpha, rho, work);
      const Real rho_next = update_residual(alpha);
      beta = hn::IfThenElseZero(goes_on, rho_next / rho);
      rho = rho_next;
      goes_on = hn::And(goes_on, rho > enough);
    }
    for (std::size_t i = 0; i < level.node_count; ++i) {
      put(L::add_scaled(alpha, node(m.direction, i), node(m.solution, i)), m.solution, i);
    }
    return {work, rho};
  }

  // Computes the states at the end of the step, and what the next step needs to know of this one.
  HWY_INLINE void advance(const Solved& solved) {
    // Springs first follow the linear law to the end of the step: the energy of this prediction, plus what the step has
    // dissipated, is the most that the next step may find.
    Real kinetic_end = L::real(0), kinetic_change = L::real(0), farthest2 = L::real(0), fastest2 = L::real(0);
    for (std::size_t i = 0; i < level.node_count; ++i) {
      const Vector y = node(m.solution, i), change = L::subtract(y, node(m.velocity, i));
      const Vector displacement = L::add_scaled(h, y, node(m.rotated_displacement, i));
      const Real mass = node_mass(i), speed2 = squared(y);
      kinetic_end = hn::MulAdd(mass, speed2, kinetic_end);
      kinetic_change = hn::MulAdd(mass, squared(change), kinetic_change);
      farthest2 = hn::Max(squared(displacement), farthest2);
      fastest2 = hn::Max(speed2, fastest2);
      put(displacement, m.displacement, i);
    }
    for (std::size_t s = 0; s < level.springs.count; ++s) {
      const Real rate = L::dot(node(m.spring_direction, s), weighted_sum(level.springs, s, m.solution));
      put(hn::MulAdd(h, rate, real_at(m.spring_elongation, s)), m.spring_elongation, s);
    }
    for (std::size_t s = 0; s < level.attachments.count; ++s) {
      put(weighted_sum(level.attachments, s, m.displacement), m.attachment_displacement, s);
    }
    // A lower bound for the linearised step: a viscosity is -h k / 3 or more (damping.hpp), so y.(h^2 K / 2 + h Q) y is
    // no less than y.(h^2 K + h Q) y / 4, that is (y.b - |y|^2_M) / 4.
    Real dissipation =
        hn::MulAdd(L::real(0.25f), hn::Max(solved.work - kinetic_end, L::real(0)), half() * kinetic_change);
    // What hands put in is energy that the hair may have.
    if (has_holds()) dissipation = dissipation + Holds<Lanes>(level, m).work();
    // Springs that have moved to a stiffer branch may have negative energy by the linear law.
    put(hn::Max(elastic_energy() + dissipation, L::real(0)), m.elastic_energy_max_j, 0);

    const Mask is_finite = hn::And(hn::IsFinite(solved.rho + kinetic_end + kinetic_change), hn::IsFinite(farthest2));
    put(hn::IfThenElseZero(is_finite, L::real(1)), m.is_finite, 0);

    // A lattice that is farther from its design than it may be is scaled down as a whole, so that the hair keeps its
    // shape.
    const Real most = L::real(level.displacement_max_m), farthest = hn::Sqrt(farthest2);
    const Real by = hn::IfThenElse(farthest > most, most / farthest, L::real(1));
    put(by * hn::Sqrt(fastest2), m.speed_max, 0);
    for (std::size_t i = 0; i < level.node_count; ++i) {
      put(L::scale(by, node(m.displacement, i)), m.displacement, i);
      // The velocity relative to the head shrinks with the displacement, as otherwise the lattice would run into its
      // bound in every step.
      put(L::add_scaled(by, node(m.solution, i), node(m.rigid_velocity, i)), m.velocity, i);
    }
  }
};

}  // namespace HWY_NAMESPACE
}  // namespace hairnet
HWY_AFTER_NAMESPACE();

#endif
