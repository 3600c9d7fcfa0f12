#include "client/view/light_volume.hpp"

#include <algorithm>
#include <cmath>

#include "client/view/drawable.hpp"

namespace hairnet::view {
namespace {

constexpr int kCellsAcross = 56;
constexpr float kCellMin_m = 0.004f;
constexpr int kMargin = 2;               // empty cells about the hair
constexpr float kFade = 5;               // cells beyond the grid over which its shade fades out
constexpr float kHairShare = 0.22f;      // of blocked light that is lost rather than scattered on
constexpr float kBodyExtinction = 1.6f;  // of a cell that holds skin
constexpr float kRootsFull_per_m2 = 4e4f;

}  // namespace

LightVolume::LightVolume(const DrawnCharacter& character, float copies, const LightRig& rig) {
  if (!lay_out(character)) return;
  const std::size_t size = index(0, 0, count_[2]);
  extinction_.assign(size, 0.0f);
  cells_.assign(size, Cell::Zero());
  add_hair(character, copies);
  for (const DrawnSurface& surface : character.surfaces) add_strip(surface);
  add_body(character);
  gather_ambient();
  trace(rig.towards[1], 1);
  trace(rig.towards[2], 2);
}

bool LightVolume::lay_out(const DrawnCharacter& character) {
  Eigen::AlignedBox3f box;
  for (const Vec3f& p : character.strand_points) {
    if (drawable(p)) box.extend(p);
  }
  for (const DrawnSurface& surface : character.surfaces) {
    if (surface.kind != DrawnSurface::Kind::strip) continue;
    for (const Vec3f& p : surface.points) {
      if (drawable(p)) box.extend(p);
    }
  }
  if (box.isEmpty()) return false;
  const Vec3f size = box.sizes();
  cell_m_ = std::max(size.maxCoeff() / kCellsAcross, kCellMin_m);
  origin_ = box.min() - Vec3f::Constant(kMargin * cell_m_);
  for (int axis = 0; axis < 3; ++axis) {
    count_[axis] = std::min(static_cast<int>(size[axis] / cell_m_), kCellsAcross) + 1 + 2 * kMargin;
  }
  return true;
}

bool LightVolume::find(const Vec3f& position, std::size_t& cell) const {
  const Vec3f at = (position - origin_) / cell_m_;
  for (int axis = 0; axis < 3; ++axis) {
    if (!(at[axis] >= 0.0f && at[axis] < static_cast<float>(count_[axis]))) return false;
  }
  cell = index(static_cast<int>(at.x()), static_cast<int>(at.y()), static_cast<int>(at.z()));
  return true;
}

void LightVolume::add_hair(const DrawnCharacter& character, float copies) {
  const float per_m = kHairShare * 0.75f * character.strand_width_m * copies / (cell_m_ * cell_m_);
  const float per_root = 1.0f / (kRootsFull_per_m2 * cell_m_ * cell_m_);
  const auto& points = character.strand_points;
  for (std::size_t s = 0; s + 1 < character.strand_begin.size(); ++s) {
    const std::uint32_t begin = character.strand_begin[s], end = character.strand_begin[s + 1];
    std::size_t cell = 0;
    if (begin < end && drawable(points[begin]) && find(points[begin], cell)) cells_[cell].w() += per_root;
    for (std::uint32_t i = begin + 1; i < end; ++i) {
      const Vec3f &a = points[i - 1], &b = points[i];
      if (!drawable(a) || !drawable(b) || !find(0.5f * (a + b), cell)) continue;
      extinction_[cell] += std::min((b - a).norm(), 4.0f * cell_m_) * per_m;
    }
  }
}

// A strip shades as the hair that it stands for, and its root is as much of a scalp as it is wide. Cloth and threads
// are thin beside hair and left out.
void LightVolume::add_strip(const DrawnSurface& surface) {
  if (surface.kind != DrawnSurface::Kind::strip) return;
  const auto& points = surface.points;
  for (std::size_t i = 0; i + 3 < points.size(); i += 2) {
    const Vec3f middle = 0.25f * (points[i] + points[i + 1] + points[i + 2] + points[i + 3]);
    const float width = std::min((points[i + 1] - points[i]).norm(), 4.0f * cell_m_);
    const float length = std::min((points[i + 2] - points[i]).norm(), 4.0f * cell_m_);
    std::size_t cell = 0;
    if (!drawable(middle) || !std::isfinite(width * length) || !find(middle, cell)) continue;
    extinction_[cell] += kHairShare * width * length / (cell_m_ * cell_m_);
    if (i == 0) cells_[cell].w() += width / cell_m_;
  }
}

void LightVolume::add_body(const DrawnCharacter& character) {
  if (character.triangles == nullptr) return;
  std::vector<std::uint8_t> solid(extinction_.size(), 0);
  for (const auto& triangle : *character.triangles) {
    const Vec3f &a = character.body_vertices[triangle[0]], &b = character.body_vertices[triangle[1]],
                &c = character.body_vertices[triangle[2]];
    if (!drawable(a) || !drawable(b) || !drawable(c)) continue;
    const float longest = std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()});
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

// Light that comes along `towards` reversed: from the far side of the grid inwards, each cell adds what it holds.
void LightVolume::sweep(const std::array<int, 3>& towards, float weight) {
  std::vector<float> depth(extinction_.size(), 0.0f);
  const float step = std::sqrt(static_cast<float>(std::abs(towards[0]) + std::abs(towards[1]) + std::abs(towards[2])));
  const auto from_outside = [&](int axis, int i) { return towards[axis] > 0 ? count_[axis] - 1 - i : i; };
  const auto inside = [&](int axis, int i) { return i >= 0 && i < count_[axis]; };
  for (int k = 0; k < count_[2]; ++k) {
    const int z = from_outside(2, k), z_next = z + towards[2];
    for (int j = 0; j < count_[1]; ++j) {
      const int y = from_outside(1, j), y_next = y + towards[1];
      for (int i = 0; i < count_[0]; ++i) {
        const int x = from_outside(0, i), x_next = x + towards[0];
        const std::size_t here = index(x, y, z);
        if (inside(0, x_next) && inside(1, y_next) && inside(2, z_next)) {
          const std::size_t next = index(x_next, y_next, z_next);
          depth[here] = depth[next] + step * extinction_[next];
        }
        cells_[here].x() += weight * std::exp(-depth[here]);
      }
    }
  }
}

void LightVolume::gather_ambient() {
  float total = 0;
  for (const bool add : {false, true}) {
    for (int x = -1; x <= 1; ++x) {
      for (int y = -1; y <= 1; ++y) {
        for (int z = -1; z <= 1; ++z) {
          const int kind = std::abs(x) + std::abs(y) + std::abs(z);
          if (kind != 1 && kind != 3) continue;  // faces and corners
          const float weight = 1.0f + 0.5f * static_cast<float>(y);
          if (add)
            sweep({x, y, z}, weight / total);
          else
            total += weight;
        }
      }
    }
  }
}

void LightVolume::trace(const Vec3f& towards, int part) {
  const Vec3f step = towards * cell_m_;
  for (int z = 0; z < count_[2]; ++z) {
    for (int y = 0; y < count_[1]; ++y) {
      for (int x = 0; x < count_[0]; ++x) {
        const Vec3f corner(static_cast<float>(x), static_cast<float>(y), static_cast<float>(z));
        Vec3f p = origin_ + (corner + Vec3f::Constant(0.5f)) * cell_m_ + 1.2f * step;
        float depth = 0;
        for (std::size_t cell = 0; depth < 8.0f && find(p, cell); p += step) depth += extinction_[cell];
        cells_[index(x, y, z)][part] = std::exp(-depth);
      }
    }
  }
}

LightVolume::Left LightVolume::at(const Vec3f& position) const {
  if (cells_.empty()) return {};
  const Vec3f at = (position - origin_) / cell_m_ - Vec3f::Constant(0.5f);
  std::array<int, 3> base{};
  Vec3f part;
  float inside = 1;
  for (int axis = 0; axis < 3; ++axis) {
    const float outside = std::max(-at[axis], at[axis] - static_cast<float>(count_[axis] - 1));
    if (!(outside < kFade)) return {};
    inside *= 1.0f - std::max(outside, 0.0f) / kFade;
    base[axis] = std::clamp(static_cast<int>(std::floor(at[axis])), 0, count_[axis] - 2);
    part[axis] = std::clamp(at[axis] - static_cast<float>(base[axis]), 0.0f, 1.0f);
  }
  Cell sum = Cell::Zero();
  for (int corner = 0; corner < 8; ++corner) {
    const int x = corner & 1, y = (corner >> 1) & 1, z = corner >> 2;
    const float weight =
        (x != 0 ? part.x() : 1 - part.x()) * (y != 0 ? part.y() : 1 - part.y()) * (z != 0 ? part.z() : 1 - part.z());
    sum += weight * cells_[index(base[0] + x, base[1] + y, base[2] + z)];
  }
  const auto faded = [&](float left) { return std::lerp(1.0f, left, inside); };
  return {faded(sum.x()), faded(sum.y()), faded(sum.z()), std::min(sum.w(), 1.0f) * inside};
}

}  // namespace hairnet::view
