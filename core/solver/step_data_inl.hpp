// Included once for each instruction set (Highway's foreach_target).
#if defined(HAIRNET_STEP_DATA_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef HAIRNET_STEP_DATA_INL
#undef HAIRNET_STEP_DATA_INL
#else
#define HAIRNET_STEP_DATA_INL
#endif

#include <cstddef>

#include "core/solver/lane_memory.hpp"
#include "core/solver/lanes_inl.hpp"
#include "core/solver/level_view.hpp"
#include "core/solver/step_terms.hpp"

// The data that every part of a step reads and writes: the level, the working memory and the terms of the tick, in one
// layout.
HWY_BEFORE_NAMESPACE();
namespace hairnet {
namespace HWY_NAMESPACE {

template <class Lanes>
struct StepData {
  using Real = typename Lanes::Real;
  using Mask = typename Lanes::Mask;
  using Vector = typename Lanes::Vector;
  using Block = typename Lanes::Block;
  using L = Lanes;
  static constexpr std::size_t kReal = Lanes::kReal, kVector = Lanes::kVector, kBlock = Lanes::kBlock;

  // The level and the memory are copies, so that the compiler knows that storing a number does not change their
  // pointers. `h` is the step's length, s.
  const LevelView level;
  const LaneMemory m;
  const Real h;

  StepData(const LevelView& level_of_all, const LaneMemory& memory)
      : level(level_of_all), m(memory), h(term(offsetof(StepTerms, step_s))) {}

  // The byte offset of a member of StepTerms names a Real: all members are floats, and each float is one Real in
  // memory.
  HWY_INLINE Real term(std::size_t byte) const { return L::load_real(m.terms + byte / sizeof(float) * kReal); }
  HWY_INLINE Vector vector_term(std::size_t byte) const {
    return L::load_components(m.terms + byte / sizeof(float) * kReal);
  }

  // A rotation.
  struct Turn {
    Vector x, y, z;  // columns
  };
  HWY_INLINE Turn rotation_term(std::size_t byte) const {
    return {vector_term(byte), vector_term(byte + 3 * sizeof(float)), vector_term(byte + 6 * sizeof(float))};
  }
  static HWY_INLINE Vector turned(const Turn& turn, const Vector& a) {
    return L::add_scaled(L::z(a), turn.z, L::add_scaled(L::y(a), turn.y, L::scale(L::x(a), turn.x)));
  }
  // The transpose of a rotation is its inverse, so the way back is three dot products.
  static HWY_INLINE Vector rotated_back(const Turn& turn, const Vector& a) {
    return L::compose(L::dot(turn.x, a), L::dot(turn.y, a), L::dot(turn.z, a));
  }
  // An AffineMap of StepTerms: x -> turn x + shift.
  struct Motion {
    Turn turn;
    Vector shift;
  };
  HWY_INLINE Motion motion_term(std::size_t byte) const {
    return {rotation_term(byte + offsetof(StepTerms::AffineMap, turn)),
            vector_term(byte + offsetof(StepTerms::AffineMap, shift))};
  }
  static HWY_INLINE Vector moved(const Motion& motion, const Vector& a) {
    return L::add(turned(motion.turn, a), motion.shift);
  }

  static HWY_INLINE Real squared(const Vector& a) { return L::dot(a, a); }
  static HWY_INLINE Real half() { return L::real(0.5f); }

  // The i-th Vector, Real or Block of an array of LaneMemory; put() stores one.
  static HWY_INLINE Vector node(const float* nodes, std::size_t i) { return L::load_vector(nodes + i * kVector); }
  static HWY_INLINE void put(const Vector& a, float* nodes, std::size_t i) { L::store_vector(a, nodes + i * kVector); }
  static HWY_INLINE Real real_at(const float* p, std::size_t i) { return L::load_real(p + i * kReal); }
  static HWY_INLINE void put(Real a, float* p, std::size_t i) { L::store_real(a, p + i * kReal); }
  static HWY_INLINE Block block_at(const float* p, std::size_t i) { return L::load_block(p + i * kBlock); }
  static HWY_INLINE void put(const Block& a, float* p, std::size_t i) { L::store_block(a, p + i * kBlock); }
};

}  // namespace HWY_NAMESPACE
}  // namespace hairnet
HWY_AFTER_NAMESPACE();

#endif
