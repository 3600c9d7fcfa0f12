// Included once for each instruction set (Highway's foreach_target).
#if defined(HAIRNET_LANES_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef HAIRNET_LANES_INL
#undef HAIRNET_LANES_INL
#else
#define HAIRNET_LANES_INL
#endif

#include <hwy/highway.h>

#include <cstddef>
#include <cstdint>

// The arithmetic of a step in two layouts. The step is written once for both: a Real is one number per character, a
// Vector one vector, a Block one symmetric 3x3 matrix of a node. Both layouts round alike in every operation, so the
// result of a character depends neither on the layout nor on the other characters in the batch.
HWY_BEFORE_NAMESPACE();
namespace hairnet {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

// Each lane is a character: many characters of one level side by side. In memory a Vector is the lanes' x, then y, then
// z.
template <class D>
struct Crowd {
  using Real = hn::Vec<D>;
  using Mask = hn::Mask<D>;
  struct Vector {
    Real x, y, z;
  };
  struct Block {
    Real xx, xy, xz, yy, yz, zz;
  };

  static constexpr D d{};
  static constexpr std::size_t kReal = hn::MaxLanes(D()), kVector = 3 * kReal, kBlock = 6 * kReal;  // floats in memory
  static constexpr bool kIsCrowd = true;

  static HWY_INLINE Real real(float x) { return hn::Set(d, x); }
  static HWY_INLINE Real load_real(const float* p) { return hn::Load(d, p); }
  static HWY_INLINE void store_real(Real a, float* p) { hn::Store(a, d, p); }

  static HWY_INLINE Vector zero() { return {hn::Zero(d), hn::Zero(d), hn::Zero(d)}; }
  // The same for all characters.
  static HWY_INLINE Vector vector(const float* xyz) { return {real(xyz[0]), real(xyz[1]), real(xyz[2])}; }
  static HWY_INLINE Vector load_vector(const float* p) {
    return {hn::Load(d, p), hn::Load(d, p + kReal), hn::Load(d, p + 2 * kReal)};
  }
  static HWY_INLINE void store_vector(const Vector& a, float* p) {
    hn::Store(a.x, d, p);
    hn::Store(a.y, d, p + kReal);
    hn::Store(a.z, d, p + 2 * kReal);
  }
  // p[index] of each lane.
  static HWY_INLINE Real gather(const float* p, hn::Vec<hn::RebindToSigned<D>> index) {
    return hn::GatherIndex(d, p, index);
  }
  // Three Reals in memory, one after the other.
  static HWY_INLINE Vector load_components(const float* p) { return load_vector(p); }

  static HWY_INLINE Vector compose(Real x, Real y, Real z) { return {x, y, z}; }
  static HWY_INLINE Real x(const Vector& a) { return a.x; }
  static HWY_INLINE Real y(const Vector& a) { return a.y; }
  static HWY_INLINE Real z(const Vector& a) { return a.z; }
  static HWY_INLINE Vector add(const Vector& a, const Vector& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
  static HWY_INLINE Vector subtract(const Vector& a, const Vector& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
  static HWY_INLINE Vector scale(Real s, const Vector& a) { return {s * a.x, s * a.y, s * a.z}; }
  // sum + s a
  static HWY_INLINE Vector add_scaled(Real s, const Vector& a, const Vector& sum) {
    return {hn::MulAdd(s, a.x, sum.x), hn::MulAdd(s, a.y, sum.y), hn::MulAdd(s, a.z, sum.z)};
  }
  // sum - s a
  static HWY_INLINE Vector subtract_scaled(Real s, const Vector& a, const Vector& sum) {
    return {hn::NegMulAdd(s, a.x, sum.x), hn::NegMulAdd(s, a.y, sum.y), hn::NegMulAdd(s, a.z, sum.z)};
  }
  // No multiply-add: the other layout multiplies in one register and then adds across its lanes, and both must round
  // alike.
  static HWY_INLINE Real dot(const Vector& a, const Vector& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
  // For long sums of dot products: adds the products of a and b component by component; sum_of returns the total.
  static HWY_INLINE Vector add_products(const Vector& a, const Vector& b, const Vector& sum) {
    return {hn::MulAdd(a.x, b.x, sum.x), hn::MulAdd(a.y, b.y, sum.y), hn::MulAdd(a.z, b.z, sum.z)};
  }
  static HWY_INLINE Real sum_of(const Vector& a) { return a.x + a.y + a.z; }
  // Takes `yes` in the lanes of the mask, and `no` in the others.
  static HWY_INLINE Vector select(Mask mask, const Vector& yes, const Vector& no) {
    return {hn::IfThenElse(mask, yes.x, no.x), hn::IfThenElse(mask, yes.y, no.y), hn::IfThenElse(mask, yes.z, no.z)};
  }

  static HWY_INLINE Block load_block(const float* p) {
    return {hn::Load(d, p),
            hn::Load(d, p + kReal),
            hn::Load(d, p + 2 * kReal),
            hn::Load(d, p + 3 * kReal),
            hn::Load(d, p + 4 * kReal),
            hn::Load(d, p + 5 * kReal)};
  }
  static HWY_INLINE void store_block(const Block& a, float* p) {
    hn::Store(a.xx, d, p);
    hn::Store(a.xy, d, p + kReal);
    hn::Store(a.xz, d, p + 2 * kReal);
    hn::Store(a.yy, d, p + 3 * kReal);
    hn::Store(a.yz, d, p + 4 * kReal);
    hn::Store(a.zz, d, p + 5 * kReal);
  }
  // The same for all characters: xx xy xz yy yz zz.
  static HWY_INLINE Block block(const float* p) {
    return {real(p[0]), real(p[1]), real(p[2]), real(p[3]), real(p[4]), real(p[5])};
  }
  static HWY_INLINE Block scale(Real s, const Block& a) {
    return {s * a.xx, s * a.xy, s * a.xz, s * a.yy, s * a.yz, s * a.zz};
  }
  static HWY_INLINE Block add_diagonal(Real s, const Block& a) {
    return {a.xx + s, a.xy, a.xz, a.yy + s, a.yz, a.zz + s};
  }
  // a a^T
  static HWY_INLINE Block square(const Vector& a) {
    return {a.x * a.x, a.x * a.y, a.x * a.z, a.y * a.y, a.y * a.z, a.z * a.z};
  }
  static HWY_INLINE Block add_scaled(Real s, const Block& a, const Block& sum) {
    return {hn::MulAdd(s, a.xx, sum.xx), hn::MulAdd(s, a.xy, sum.xy), hn::MulAdd(s, a.xz, sum.xz),
            hn::MulAdd(s, a.yy, sum.yy), hn::MulAdd(s, a.yz, sum.yz), hn::MulAdd(s, a.zz, sum.zz)};
  }
  static HWY_INLINE Vector multiply(const Block& a, const Vector& b) {
    return {hn::MulAdd(a.xz, b.z, hn::MulAdd(a.xy, b.y, a.xx * b.x)),
            hn::MulAdd(a.yz, b.z, hn::MulAdd(a.yy, b.y, a.xy * b.x)),
            hn::MulAdd(a.zz, b.z, hn::MulAdd(a.yz, b.y, a.xz * b.x))};
  }
  // Computed by cofactors. The operations and their order are those of the cross products below.
  static HWY_INLINE Block inverse(const Block& a) {
    const Real xx = minor(a.yy, a.zz, a.yz, a.yz), xy = minor(a.yz, a.xz, a.xy, a.zz),
               xz = minor(a.xy, a.yz, a.xz, a.yy);
    const Real yy = minor(a.zz, a.xx, a.xz, a.xz), yz = minor(a.xz, a.xy, a.yz, a.xx),
               zz = minor(a.xx, a.yy, a.xy, a.xy);
    const Real by = real(1) / (a.xx * xx + a.xy * xy + a.xz * xz);
    return {by * xx, by * xy, by * xz, by * yy, by * yz, by * zz};
  }

 private:
  // a b - c d
  static HWY_INLINE Real minor(Real a, Real b, Real c, Real e) { return hn::MulSub(a, b, c * e); }
};

#if HWY_TARGET == HWY_SCALAR
// One character, on machines without registers of four: a crowd of one.
struct Single : Crowd<hn::CappedTag<float, 1>> {
  static constexpr bool kIsCrowd = false;
};
#else
// One character: a Vector is [x y z 0] in one register, a Real the same number in all its lanes. In memory a Real is
// one float.
struct Single {
  using D = hn::FixedTag<float, 4>;
  using Real = hn::Vec<D>;
  using Mask = hn::Mask<D>;
  struct Vector {
    Real v;
  };
  struct Block {
    Real x, y, z;  // columns
  };

  static constexpr D d{};
  static constexpr std::size_t kReal = 1, kVector = 4, kBlock = 12;
  static constexpr bool kIsCrowd = false;

  static HWY_INLINE Real real(float x) { return hn::Set(d, x); }
  static HWY_INLINE Real load_real(const float* p) { return hn::Set(d, *p); }
  static HWY_INLINE void store_real(Real a, float* p) { *p = hn::GetLane(a); }

  static HWY_INLINE Vector zero() { return {hn::Zero(d)}; }
  // These loads never wait for a store; a padded copy on the stack would.
  static HWY_INLINE Vector vector(const float* xyz) {
    const hn::FixedTag<float, 2> pair;
    const hn::FixedTag<float, 1> one;
    return {hn::Combine(d, hn::ZeroExtendVector(pair, hn::LoadU(one, xyz + 2)), hn::LoadU(pair, xyz))};
  }
  static HWY_INLINE Vector load_vector(const float* p) { return {hn::Load(d, p)}; }
  static HWY_INLINE void store_vector(const Vector& a, float* p) { hn::Store(a.v, d, p); }
  static HWY_INLINE Real gather(const float* p, hn::Vec<hn::RebindToSigned<D>> index) {
    return hn::Set(d, p[hn::GetLane(index)]);
  }
  static HWY_INLINE Vector load_components(const float* p) { return vector(p); }

  static HWY_INLINE Vector compose(Real x, Real y, Real z) {
    const Real none = hn::Zero(d);
    const Real xy = hn::IfThenElse(hn::FirstN(d, 1), x, y);
    return {hn::IfThenElse(hn::FirstN(d, 2), xy, hn::IfThenElse(hn::FirstN(d, 3), z, none))};
  }
  static HWY_INLINE Real x(const Vector& a) { return hn::Broadcast<0>(a.v); }
  static HWY_INLINE Real y(const Vector& a) { return hn::Broadcast<1>(a.v); }
  static HWY_INLINE Real z(const Vector& a) { return hn::Broadcast<2>(a.v); }
  static HWY_INLINE Vector add(const Vector& a, const Vector& b) { return {a.v + b.v}; }
  static HWY_INLINE Vector subtract(const Vector& a, const Vector& b) { return {a.v - b.v}; }
  static HWY_INLINE Vector scale(Real s, const Vector& a) { return {s * a.v}; }
  static HWY_INLINE Vector add_scaled(Real s, const Vector& a, const Vector& sum) {
    return {hn::MulAdd(s, a.v, sum.v)};
  }
  static HWY_INLINE Vector subtract_scaled(Real s, const Vector& a, const Vector& sum) {
    return {hn::NegMulAdd(s, a.v, sum.v)};
  }
  static HWY_INLINE Real dot(const Vector& a, const Vector& b) { return sum_of({a.v * b.v}); }
  static HWY_INLINE Vector add_products(const Vector& a, const Vector& b, const Vector& sum) {
    return {hn::MulAdd(a.v, b.v, sum.v)};
  }
  static HWY_INLINE Real sum_of(const Vector& a) { return x(a) + y(a) + z(a); }
  static HWY_INLINE Vector select(Mask mask, const Vector& yes, const Vector& no) {
    return {hn::IfThenElse(mask, yes.v, no.v)};
  }

  static HWY_INLINE Block load_block(const float* p) {
    return {hn::Load(d, p), hn::Load(d, p + 4), hn::Load(d, p + 8)};
  }
  static HWY_INLINE void store_block(const Block& a, float* p) {
    hn::Store(a.x, d, p);
    hn::Store(a.y, d, p + 4);
    hn::Store(a.z, d, p + 8);
  }
  static HWY_INLINE Block block(const float* p) {
    // Two loads that overlap, xx xy xz yy and xz yy yz zz, have all six numbers; the columns are shuffled from them.
    const Real low = hn::LoadU(d, p), high = hn::LoadU(d, p + 2), xyz = hn::IfThenElseZero(hn::FirstN(d, 3), low);
    const Real z = hn::IfThenElseZero(hn::FirstN(d, 3), from<0, 2, 3>(high));
    const Real y = hn::IfThenElse(hn::FirstN(d, 2), from<1, 3, 3>(low), from<3, 3, 1>(z));
    return {xyz, hn::IfThenElseZero(hn::FirstN(d, 3), y), z};
  }
  static HWY_INLINE Block scale(Real s, const Block& a) { return {s * a.x, s * a.y, s * a.z}; }
  static HWY_INLINE Block add_diagonal(Real s, const Block& a) {
    const Real none = hn::Zero(d);
    // The masks of the first one, two and three lanes differ by one lane, so their differences are s in a single lane.
    const Real x = hn::IfThenElse(hn::FirstN(d, 1), s, none), z = hn::IfThenElse(hn::FirstN(d, 3), s, none);
    const Real xy = hn::IfThenElse(hn::FirstN(d, 2), s, none);
    return {a.x + x, a.y + (xy - x), a.z + (z - xy)};
  }
  static HWY_INLINE Block square(const Vector& a) { return {a.v * x(a), a.v * y(a), a.v * z(a)}; }
  static HWY_INLINE Block add_scaled(Real s, const Block& a, const Block& sum) {
    return {hn::MulAdd(s, a.x, sum.x), hn::MulAdd(s, a.y, sum.y), hn::MulAdd(s, a.z, sum.z)};
  }
  static HWY_INLINE Vector multiply(const Block& a, const Vector& b) {
    return {hn::MulAdd(a.z, z(b), hn::MulAdd(a.y, y(b), a.x * x(b)))};
  }
  // The inverse's columns are the cross products of a's columns, over their triple product.
  static HWY_INLINE Block inverse(const Block& a) {
    const Real x = cross(a.y, a.z), y = cross(a.z, a.x), z = cross(a.x, a.y);
    const Real by = real(1) / dot({a.x}, {x});
    return {by * x, by * y, by * z};
  }

 private:
  template <std::int32_t kX, std::int32_t kY, std::int32_t kZ>
  static HWY_INLINE Real from(Real a) {
    HWY_ALIGN static constexpr std::int32_t kFrom[4] = {kX, kY, kZ, 3};
    return hn::TableLookupLanes(a, hn::SetTableIndices(d, kFrom));
  }
  static HWY_INLINE Real yzx(Real a) { return from<1, 2, 0>(a); }
  static HWY_INLINE Real zxy(Real a) { return from<2, 0, 1>(a); }
  static HWY_INLINE Real cross(Real a, Real b) { return hn::MulSub(yzx(a), zxy(b), zxy(a) * yzx(b)); }
};
#endif

}  // namespace HWY_NAMESPACE
}  // namespace hairnet
HWY_AFTER_NAMESPACE();

#endif
