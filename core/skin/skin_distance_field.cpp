#include "core/skin/skin_distance_field.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/assert.hpp"

namespace hairnet {
static_assert(kSkinNodesMax <= 1 << std::numeric_limits<float>::digits, "an entry's number is exact in float");

double skin_distance(const SkinDistanceField& field, const Vec3& point, Vec3* gradient) {
  HAIRNET_ASSERT(field.cell_m > 0);
  HAIRNET_VALIDATE(std::ranges::min(field.dims) >= 2);
  HAIRNET_VALIDATE(std::cmp_equal(field.distance.size(), field.dims[0] * field.dims[1] * field.dims[2]));
  const Vec3 at = (point - field.origin.cast<double>()) / static_cast<double>(field.cell_m);
  Vec3 within, t;
  std::array<int, 3> low;
  for (int a = 0; a < 3; ++a) {
    const int cells = field.dims[static_cast<std::size_t>(a)] - 1;
    within[a] = std::clamp(at[a], 0.0, static_cast<double>(cells));
    // The last node belongs to the cell below it, so that its neighbour exists.
    low[static_cast<std::size_t>(a)] = std::min(static_cast<int>(within[a]), cells - 1);
    t[a] = within[a] - low[static_cast<std::size_t>(a)];
  }
  double corner[2][2][2];
  for (int c = 0; c < 8; ++c) {
    const int i = c & 1, j = c >> 1 & 1, k = c >> 2;
    const int entry = low[0] + i + field.dims[0] * (low[1] + j + field.dims[1] * (low[2] + k));
    corner[k][j][i] = static_cast<double>(field.distance[static_cast<std::size_t>(entry)]);
  }
  const auto mix = [](double s, double a, double b) { return a + s * (b - a); };
  double edge[2][2], slope_x[2][2];
  for (int c = 0; c < 4; ++c) {
    const auto& pair = corner[c >> 1][c & 1];
    edge[c >> 1][c & 1] = mix(t.x(), pair[0], pair[1]);
    slope_x[c >> 1][c & 1] = pair[1] - pair[0];
  }
  const double low_face = mix(t.y(), edge[0][0], edge[0][1]), high_face = mix(t.y(), edge[1][0], edge[1][1]);
  if (gradient) {
    const auto over_yz = [&](const double(&s)[2][2]) {
      return mix(t.z(), mix(t.y(), s[0][0], s[0][1]), mix(t.y(), s[1][0], s[1][1]));
    };
    *gradient =
        Vec3(over_yz(slope_x), mix(t.z(), edge[0][1] - edge[0][0], edge[1][1] - edge[1][0]), high_face - low_face) /
        static_cast<double>(field.cell_m);
  }
  return mix(t.z(), low_face, high_face) + static_cast<double>(field.cell_m) * (at - within).norm();
}

std::uint8_t skin_byte(float distance_m) {
  return static_cast<std::uint8_t>(std::clamp(std::round((distance_m - kSkinDeepest_m) / kSkinStep_m), 0.0f, 255.0f));
}

std::string validate(const Skin& skin) {
  std::array<bool, kBoneCount> is_met{};
  for (const SkinDistanceField& field : skin) {
    const auto bone = static_cast<std::size_t>(field.bone);
    // Skins come with files of levels and of bases. The kernels look at no bounds, so counts and sizes are checked
    // here.
    if (bone >= kBoneCount || std::exchange(is_met[bone], true)) return "skin: no such bone, or two fields of one";
    if (!field.origin.allFinite() || field.origin.cwiseAbs().maxCoeff() > kSkinNumberMax)
      return "skin: an origin is not finite";
    if (!(field.cell_m >= kSkinCellMin_m && field.cell_m <= kSkinNumberMax)) return "skin: a cell without size";
    std::size_t count = 1;
    for (const int nodes : field.dims) {
      if (nodes < 2 || nodes > kSkinNodesMax) return "skin: a grid of no or too many nodes";
      count *= static_cast<std::size_t>(nodes);
    }
    if (count > kSkinNodesMax || field.distance.size() != count) return "skin: counts disagree";
    const auto is_distance = [](float m) { return m >= -kSkinNumberMax && m <= kSkinNumberMax; };
    if (!std::ranges::all_of(field.distance, is_distance)) return "skin: a distance is not finite";
  }
  return {};
}

}  // namespace hairnet
