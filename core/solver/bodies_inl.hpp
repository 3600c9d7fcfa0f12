// Included once for each instruction set (Highway's foreach_target).
#if defined(HAIRNET_BODIES_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef HAIRNET_BODIES_INL
#undef HAIRNET_BODIES_INL
#else
#define HAIRNET_BODIES_INL
#endif

#include <cstddef>

#include "core/solver/body_contact.hpp"
#include "core/solver/step_data_inl.hpp"
#include "core/solver/touch_terms.hpp"

// Hands and props as rounded boxes: distances, and whether hair on its way meets one.
HWY_BEFORE_NAMESPACE();
namespace hairnet {
namespace HWY_NAMESPACE {

template <class Lanes>
struct Bodies : StepData<Lanes> {
  using Data = StepData<Lanes>;
  using Data::Data, Data::m, Data::squared, Data::kReal;
  using typename Data::L, typename Data::Real, typename Data::Mask, typename Data::Vector, typename Data::Motion;

  // Bodies lie in memory as StepTerms do: each number of BodyTerms is a Real, so the byte offset of a member names a
  // Real.
  HWY_INLINE const float* at(std::size_t body, std::size_t byte) const {
    return m.bodies + (body * kBodyTermCount + byte / sizeof(float)) * kReal;
  }
  HWY_INLINE Real real_of(std::size_t body, std::size_t byte) const { return L::load_real(at(body, byte)); }
  HWY_INLINE Vector vector_of(std::size_t body, std::size_t byte) const { return L::load_components(at(body, byte)); }
  HWY_INLINE Motion motion_of(std::size_t body, std::size_t byte) const {
    constexpr std::size_t kColumn = 3 * sizeof(float);
    const std::size_t turn = byte + offsetof(StepTerms::AffineMap, turn);
    return {{vector_of(body, turn), vector_of(body, turn + kColumn), vector_of(body, turn + 2 * kColumn)},
            vector_of(body, byte + offsetof(StepTerms::AffineMap, shift))};
  }

  // Whether hair at `from` that moves by `way` may meet the body in this step; head space. The ball covers the body's
  // own way in the step, so a body that is far away costs one distance a point.
  HWY_INLINE bool is_near(std::size_t body, const Vector& from, Real way) const {
    const Real reach = real_of(body, offsetof(BodyTerms, near_m)) + way;
    return !hn::AllFalse(
        L::d, hn::Lt(squared(L::subtract(from, vector_of(body, offsetof(BodyTerms, centre)))), reach * reach));
  }

  // The signed distance of a point from the surface and the unit normal, as shape_distance() of
  // core/touch/touch_shape.hpp computes them, in the body's own axes.
  struct Sample {
    Real distance;
    Vector normal;
  };
  HWY_INLINE Sample sample(std::size_t body, const Vector& point) const {
    const Real none = L::real(0);
    const Vector half = vector_of(body, offsetof(BodyTerms, half_size));
    const Real x = L::x(point), y = L::y(point), z = L::z(point);
    const Real qx = hn::Abs(x) - L::x(half), qy = hn::Abs(y) - L::y(half), qz = hn::Abs(z) - L::z(half);
    const Real ox = hn::Max(qx, none), oy = hn::Max(qy, none), oz = hn::Max(qz, none);
    const Real outside = hn::Sqrt(ox * ox + oy * oy + oz * oz);
    const Real inside = hn::Min(hn::Max(qy, hn::Max(qx, qz)), none);
    // Within the box the way out is through the nearest face.
    const Mask is_out = hn::Gt(outside, none);
    // The order of preference is that of nearest_face() in touch_shape.cpp: y, then x, then z. The reference then finds
    // the same normal.
    const Mask by_y = hn::And(hn::Ge(qy, qx), hn::Ge(qy, qz));
    const Mask by_x = hn::AndNot(by_y, hn::Ge(qx, qz));
    const Real one = L::real(1), to_unit = one / hn::Max(outside, L::real(1e-30f));
    const Real nx = hn::IfThenElse(is_out, ox * to_unit, hn::IfThenElseZero(by_x, one));
    const Real ny = hn::IfThenElse(is_out, oy * to_unit, hn::IfThenElseZero(by_y, one));
    const Real nz = hn::IfThenElse(is_out, oz * to_unit, hn::IfThenZeroElse(hn::Or(by_x, by_y), one));
    const Real side = real_of(body, offsetof(BodyTerms, side));
    const auto towards = [&](Real n, Real along)
                             HWY_ATTR { return side * hn::IfThenElse(hn::Lt(along, none), none - n, n); };
    return {side * (outside + inside - real_of(body, offsetof(BodyTerms, radius_m))),
            L::compose(towards(nx, x), towards(ny, y), towards(nz, z))};
  }

  // Whether hair comes nearer to the surface than kTouchReach_m while it travels from `from` by `travel`; own axes of
  // the body. `beyond`: how much farther than that it is at the start.
  HWY_INLINE Mask comes_in(std::size_t body, const Vector& from, const Vector& travel, Real beyond) const {
    const Real one = L::real(1), none = L::real(0);
    const Real way = hn::Max(hn::Sqrt(squared(travel)), L::real(1e-30f));
    Real share = none;
    Mask hits = hn::Lt(one, none);
    // The point goes as far as the distance allows, so it cannot pass through the surface between two places. Only the
    // smallest share of the way breaks this bound: without it, a point that grazes the surface would hardly move on.
    for (int place = 0; place < kSweepPlaces; ++place) {
      share = hn::Min(share + hn::Max(beyond / way, L::real(static_cast<float>(kSweepShareMin))), one);
      beyond = sample(body, L::add_scaled(share, travel, from)).distance - L::real(static_cast<float>(kTouchReach_m));
      hits = hn::Or(hits, hn::Lt(beyond, none));
    }
    return hits;
  }
};

}  // namespace HWY_NAMESPACE
}  // namespace hairnet
HWY_AFTER_NAMESPACE();

#endif
