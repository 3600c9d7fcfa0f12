#include "core/modes/basis.hpp"

#include <algorithm>
#include <cmath>

#include "core/assert.hpp"

namespace hairnet {

std::string validate(const Basis& basis) {
  const std::size_t count = basis.mode_count();
  if (count == 0 || count > kModeCountMax) return "a basis has 1 to " + std::to_string(kModeCountMax) + " modes";
  if (basis.node_count == 0) return "a basis without nodes";
  if (basis.unit.size() != count) return "a basis with another number of units than modes";
  if (basis.modes.size() != 3 * count * basis.node_count) return "a basis whose modes have another number of nodes";
  const auto is_size = [](float value) { return std::isfinite(value) && value > 0; };
  if (!std::ranges::all_of(basis.unit, is_size)) return "a basis with a unit that is not positive";
  if (!std::ranges::all_of(basis.deviation_m, is_size)) return "a basis with a deviation that is not positive";
  // Senders leave out the last coefficients first, so the order is part of what a basis promises.
  if (!std::ranges::is_sorted(basis.deviation_m, std::greater{})) return "a basis whose deviations ascend";
  return {};
}

void displacements_of(const Basis& basis, std::span<const float> coefficients, std::span<Vec3f> out) {
  HAIRNET_ASSERT(coefficients.size() <= basis.mode_count());
  HAIRNET_ASSERT(out.size() == basis.node_count);
  using Eigen::Index;
  Eigen::Map<Eigen::VectorXf> sum(out.data()->data(), static_cast<Index>(3 * out.size()));
  sum.setZero();
  const std::int16_t* mode = basis.modes.data();
  for (std::size_t k = 0; k < coefficients.size(); ++k, mode += sum.size()) {
    if (coefficients[k] == 0) continue;
    using Integers = Eigen::Map<const Eigen::Matrix<std::int16_t, Eigen::Dynamic, 1>>;
    sum += (coefficients[k] * basis.unit[k]) * Integers(mode, sum.size()).cast<float>();
  }
}

}  // namespace hairnet
