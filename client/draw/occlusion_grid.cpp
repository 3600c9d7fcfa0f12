#include "client/draw/occlusion_grid.hpp"

#include <algorithm>
#include <cmath>

namespace hairnet::draw {
namespace {

// The number of cells along the longest side of the hair. Memory grows with its third power, and each cell has 14 rays.
constexpr int kCellsAcross = 56;
// Smaller cells would hold one strand or none, and the light would be spotted.
constexpr float kCellMin_m = 0.004f;
// This many empty cells surround the hair, so that the light at its border is interpolated towards full light.
constexpr int kMargin = 2;
// Points of groom files are multiples of 0.05 mm. No side of a cell lies on one: rounding would decide its cell.
constexpr float kBetweenPoints_m = 1.9e-5f;
// Over this many cells outside of the grid its shade fades out. A hard end would show as an edge on the body.
constexpr float kFade = 5;
// Skin in a cell adds this optical depth. One cell of skin lets exp(-1.6), a fifth, of the light through, and two cells
// a twenty-fifth: so the edge of the shade is soft.
constexpr float kBodyExtinction = 1.6f;
// Faces first, then corners: gather() gives rays below 6 the weight of faces.
constexpr std::array<std::array<int, 3>, 14> kRays{{{1, 0, 0},
                                                    {-1, 0, 0},
                                                    {0, 1, 0},
                                                    {0, -1, 0},
                                                    {0, 0, 1},
                                                    {0, 0, -1},
                                                    {1, 1, 1},
                                                    {1, 1, -1},
                                                    {1, -1, 1},
                                                    {1, -1, -1},
                                                    {-1, 1, 1},
                                                    {-1, 1, -1},
                                                    {-1, -1, 1},
                                                    {-1, -1, -1}}};

Vec3f direction_of(const std::array<int, 3>& ray) {
  return Vec3f(static_cast<float>(ray[0]), static_cast<float>(ray[1]), static_cast<float>(ray[2])).normalized();
}

}  // namespace

OcclusionGrid::OcclusionGrid(const Groom& groom, float width_m) {
  if (!lay_out(groom)) return;
  const std::size_t size = index(0, 0, count_[2]);
  extinction_.assign(size, 0.0f);
  transmittance_.assign(size, Rays{});
  add_hair(groom, width_m);
  add_cards(groom);
  add_body(groom.body.mesh);
  for (std::size_t ray = 0; ray < kRays.size(); ++ray) sweep(ray);
}

// Body and cloth do not count for the box: only hair needs fine cells, and gather() fades out beyond.
bool OcclusionGrid::lay_out(const Groom& groom) {
  Eigen::AlignedBox3f box;
  for (std::uint32_t p = 0; p < groom.strand_begin.back(); ++p) box.extend(groom.points[p]);
  for (const HairCard& card : groom.cards) {
    for (const Vec3f& p : groom.points_of(card.points)) box.extend(p);
  }
  if (box.isEmpty()) return false;
  const Vec3f size = box.sizes();
  cell_m_ = std::max(size.maxCoeff() / kCellsAcross, kCellMin_m);
  origin_ = box.min() - Vec3f::Constant(kMargin * cell_m_ + kBetweenPoints_m);
  for (int axis = 0; axis < 3; ++axis) {
    count_[static_cast<std::size_t>(axis)] =
        std::min(static_cast<int>(size[axis] / cell_m_), kCellsAcross) + 1 + 2 * kMargin;
  }
  return true;
}

bool OcclusionGrid::find(const Vec3f& position, std::size_t& cell) const {
  const Vec3f at = (position - origin_) / cell_m_;
  for (int axis = 0; axis < 3; ++axis) {
    // The negated form also refuses what is no number.
    if (!(at[axis] >= 0.0f && at[axis] < static_cast<float>(count_[static_cast<std::size_t>(axis)]))) return false;
  }
  cell = index(static_cast<int>(at.x()), static_cast<int>(at.y()), static_cast<int>(at.z()));
  return true;
}

void OcclusionGrid::add_hair(const Groom& groom, float width_m) {
  // A metre of strand adds this optical depth to its cell: its projected area divided by the area of the cell's face.
  const float per_m = kHairShare * kMeanTaper * width_m / (cell_m_ * cell_m_);
  for (std::size_t s = 0; s < groom.strand_count(); ++s) {
    const std::span<const Vec3f> strand = groom.strand_points(s);
    std::size_t cell = 0;
    for (std::size_t i = 1; i < strand.size(); ++i) {
      // A long segment counts in several cells.
      const Vec3f step = strand[i] - strand[i - 1];
      // A damaged groom may have a segment of metres: 64 pieces bound the work.
      const int pieces = std::clamp(static_cast<int>(std::ceil(step.norm() / cell_m_)), 1, 64);
      for (int piece = 0; piece < pieces; ++piece) {
        const float t = (static_cast<float>(piece) + 0.5f) / static_cast<float>(pieces);
        if (find(strand[i - 1] + t * step, cell)) extinction_[cell] += step.norm() / static_cast<float>(pieces) * per_m;
      }
    }
  }
}

// A card shades like the hair that it replaces. Cloth and threads are thin compared with hair and are left out.
void OcclusionGrid::add_cards(const Groom& groom) {
  for (const HairCard& card : groom.cards) {
    const std::span<const Vec3f> points = groom.points_of(card.points);
    for (std::size_t i = 0; i + 3 < points.size(); i += 2) {
      const Vec3f middle = 0.25f * (points[i] + points[i + 1] + points[i + 2] + points[i + 3]);
      // The whole piece counts in the cell of its middle; the limits of four cells keep a large card from making that
      // cell black.
      const float width = std::min((points[i + 1] - points[i]).norm(), 4.0f * cell_m_);
      const float length = std::min((points[i + 2] - points[i]).norm(), 4.0f * cell_m_);
      std::size_t cell = 0;
      if (!find(middle, cell)) continue;
      extinction_[cell] += kHairShare * width * length / (cell_m_ * cell_m_);
    }
  }
}

void OcclusionGrid::add_body(const TriangleMesh& mesh) {
  // A cell is marked once, however many triangles pass through it: a fine mesh shades no more than a coarse one.
  std::vector<std::uint8_t> solid(extinction_.size(), 0);
  for (const auto& triangle : mesh.triangles) {
    const Vec3f &a = mesh.vertices[triangle[0]], &b = mesh.vertices[triangle[1]], &c = mesh.vertices[triangle[2]];
    const float longest = std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()});
    // The bound of 24 steps limits the work. A triangle of more cells marks some of its cells only.
    const int steps = std::clamp(static_cast<int>(std::ceil(longest / cell_m_)), 1, 24);
    for (int i = 0; i <= steps; ++i) {
      for (int j = 0; i + j <= steps; ++j) {
        std::size_t cell = 0;
        const float u = static_cast<float>(i) / static_cast<float>(steps);
        const float v = static_cast<float>(j) / static_cast<float>(steps);
        if (find(a + u * (b - a) + v * (c - a), cell)) solid[cell] = 1;
      }
    }
  }
  for (std::size_t i = 0; i < solid.size(); ++i) {
    if (solid[i] != 0) extinction_[i] += kBodyExtinction;
  }
}

// Follows a ray of light backwards: from the far side of the grid inwards, adding the extinction of each cell. The
// loops visit the neighbour towards the light before each cell, so one pass suffices for all cells.
void OcclusionGrid::sweep(std::size_t ray) {
  const std::array<int, 3>& towards = kRays[ray];
  std::vector<float> depth(extinction_.size(), 0.0f);
  // A diagonal step is longer by the square root of 3, and passes as much more hair.
  const float step = std::sqrt(static_cast<float>(std::abs(towards[0]) + std::abs(towards[1]) + std::abs(towards[2])));
  const auto from_outside = [&](std::size_t axis, int i) { return towards[axis] > 0 ? count_[axis] - 1 - i : i; };
  const auto inside = [&](std::size_t axis, int i) { return i >= 0 && i < count_[axis]; };
  for (int k = 0; k < count_[2]; ++k) {
    const int z = from_outside(2, k), z_next = z + towards[2];
    for (int j = 0; j < count_[1]; ++j) {
      const int y = from_outside(1, j), y_next = y + towards[1];
      for (int i = 0; i < count_[0]; ++i) {
        const int x = from_outside(0, i), x_next = x + towards[0];
        const std::size_t here = index(x, y, z);
        // A cell at the border has no neighbour towards the light, and gets all of it: depth stays 0.
        if (inside(0, x_next) && inside(1, y_next) && inside(2, z_next)) {
          const std::size_t next = index(x_next, y_next, z_next);
          depth[here] = depth[next] + step * extinction_[next];
        }
        transmittance_[here][ray] = std::exp(-depth[here]);
      }
    }
  }
}

// Interpolates the rays of the eight cells around a place. Each of the six directions then averages the ray through the
// cube's face (one half) and the rays through the four corners of that face (the other half). On a surface, only rays
// from in front of it count.
Transmittance OcclusionGrid::gather(const Vec3f& position, const Vec3f& normal) const {
  Transmittance sum{1, 1, 1, 1, 1, 1};
  if (transmittance_.empty()) return sum;
  const Vec3f at = (position - origin_) / cell_m_ - Vec3f::Constant(0.5f);
  std::array<int, 3> base{};
  Vec3f part;
  float inside = 1;
  // The product over the axes makes the shade fade out smoothly around corners, too.
  for (int axis = 0; axis < 3; ++axis) {
    const int cells = count_[static_cast<std::size_t>(axis)];
    const float outside = std::max(-at[axis], at[axis] - static_cast<float>(cells - 1));
    // The negated form returns full light for a place that is no number.
    if (!(outside < kFade)) return sum;
    inside *= 1.0f - std::max(outside, 0.0f) / kFade;
    base[static_cast<std::size_t>(axis)] = std::clamp(static_cast<int>(std::floor(at[axis])), 0, cells - 2);
    part[axis] = std::clamp(at[axis] - static_cast<float>(base[static_cast<std::size_t>(axis)]), 0.0f, 1.0f);
  }
  Rays rays{};
  for (int corner = 0; corner < 8; ++corner) {
    const int x = corner & 1, y = (corner >> 1) & 1, z = corner >> 2;
    const float weight =
        (x != 0 ? part.x() : 1 - part.x()) * (y != 0 ? part.y() : 1 - part.y()) * (z != 0 ? part.z() : 1 - part.z());
    const Rays& cell = transmittance_[index(base[0] + x, base[1] + y, base[2] + z)];
    for (std::size_t ray = 0; ray < rays.size(); ++ray) rays[ray] += weight * cell[ray];
  }
  const bool surface = normal.squaredNorm() > 0;
  for (std::size_t side = 0; side < 6; ++side) {
    // The small start keeps the division defined.
    float left = 0, weights = 1e-6f;
    for (std::size_t ray = 0; ray < rays.size(); ++ray) {
      const int along = kRays[ray][side / 2] * (side % 2 == 0 ? 1 : -1);
      if (along <= 0) continue;
      // A little weight remains for rays from behind, so that no side of a surface is undefined.
      const float before = surface ? std::max(normal.dot(direction_of(kRays[ray])), 0.02f) : 1;
      // A face has weight one half, and each of its four corners an eighth.
      const float weight = (ray < 6 ? 0.5f : 0.125f) * before;
      left += weight * rays[ray];
      weights += weight;
    }
    sum[side] = std::lerp(1.0f, left / weights, inside);
  }
  return sum;
}

}  // namespace hairnet::draw
