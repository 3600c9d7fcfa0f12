#include "client/assets/import/fill_strands.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <nanoflann.hpp>
#include <vector>

#include "core/geometry/rotation_between.hpp"
#include "core/random.hpp"

namespace hairnet {
namespace {

// Three guides surround a root on a surface; more would smooth the hairstyle.
constexpr std::size_t kGuidesPerStrand = 3;
// Guides of more points would multiply the groom's size.
constexpr std::size_t kPointsMax = 64;
// A root is filled up to this many times the usual distance of a guide's second neighbour. Smaller values leave holes
// between uneven guides; larger ones grow hair beyond the hairline.
constexpr float kReach = 1.2f;
// Sparse guides must not spread hair over the face, whatever their usual distance is.
constexpr float kReachMax_m = 0.03f;
// Guides whose directions differ by more than 60 degrees are not mixed.
constexpr float kSameWay = 0.5f;

// A strand of the groom that new strands follow.
struct Guide {
  std::uint32_t strand = 0;
  Vec3f root = Vec3f::Zero();
  // The direction from the root to the point at half of the length.
  Vec3f way = Vec3f::Zero();
  // The direction out of the head at the root.
  Vec3f out = Vec3f::Zero();
};

// The point at a share of a polyline's length.
Vec3f point_at(std::span<const Vec3f> line, std::span<const float> length, float share) {
  const float at = share * length.back();
  const auto after = std::upper_bound(length.begin() + 1, length.end() - 1, at);
  // The search leaves out the ends, so `i` is a valid segment even for a share of 1.
  const auto i = static_cast<std::size_t>(after - length.begin());
  const float step = length[i] - length[i - 1];
  const float part = step > 0 ? (at - length[i - 1]) / step : 0;
  return line[i - 1] + std::clamp(part, 0.f, 1.f) * (line[i] - line[i - 1]);
}

std::vector<float> lengths_along(std::span<const Vec3f> line) {
  std::vector<float> length{0};
  for (std::size_t i = 1; i < line.size(); ++i) length.push_back(length.back() + (line[i] - line[i - 1]).norm());
  return length;
}

std::vector<Guide> guides_of(const Groom& groom, const Vec3f& centre) {
  std::vector<Guide> guides;
  for (std::uint32_t s = 0; s < groom.strand_count(); ++s) {
    const std::span<const Vec3f> line = groom.strand_points(s);
    if (!groom.strands[s].rooted || line.size() < 2) continue;
    // Half of the length shows where a strand leads: roots stand up from the skin, and tips turn anywhere.
    const Vec3f way = point_at(line, lengths_along(line), 0.5f) - line.front();
    guides.push_back({s, line.front(), way.normalized(), (line.front() - centre).normalized()});
  }
  return guides;
}

// The guides nearest to a root, nearest first, with the squares of their distances.
struct Nearest {
  std::array<std::size_t, kGuidesPerStrand> guide{};
  std::array<float, kGuidesPerStrand> distance2{};
};

// Finds them with a k-d tree. The names of the first three functions are nanoflann's.
class Roots {
 public:
  explicit Roots(std::span<const Guide> guides) : guides_(guides), tree_(3, *this) {}

  [[nodiscard]] std::size_t kdtree_get_point_count() const { return guides_.size(); }
  [[nodiscard]] float kdtree_get_pt(std::size_t g, std::size_t axis) const {
    return guides_[g].root[static_cast<Eigen::Index>(axis)];
  }
  template <class Box>
  bool kdtree_get_bbox(Box& /*box*/) const {
    return false;
  }

  [[nodiscard]] Nearest nearest_to(const Vec3f& root) const {
    Nearest nearest;
    // The search needs at least three guides, which `fill_strands` has checked.
    tree_.knnSearch(root.data(), kGuidesPerStrand, nearest.guide.data(), nearest.distance2.data());
    return nearest;
  }

 private:
  std::span<const Guide> guides_;
  nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, Roots>, Roots, 3, std::size_t> tree_;
};

// The distance over the skin within which a guide's hair may be copied: that to the second nearest guide, at the median
// of the guides, times kReach.
float reach_of(std::span<const Guide> guides, const Roots& roots) {
  std::vector<float> gaps;
  // The nearest root is the guide itself, so index 2 is its second neighbour. The median ignores single guides far from
  // all others.
  for (const Guide& guide : guides) gaps.push_back(std::sqrt(roots.nearest_to(guide.root).distance2[2]));
  const auto middle = gaps.begin() + static_cast<std::ptrdiff_t>(gaps.size() / 2);
  std::ranges::nth_element(gaps, middle);
  return std::min(kReach * *middle, kReachMax_m);
}

// Draws points of a mesh, evenly by area, from the triangles near the guides.
class SkinSampler {
 public:
  SkinSampler(const TriangleMesh& mesh, std::span<const Guide> guides, float reach) : mesh_(mesh) {
    Vec3f low = guides.front().root, high = low;
    for (const Guide& guide : guides) {
      low = low.cwiseMin(guide.root);
      high = high.cwiseMax(guide.root);
    }
    low.array() -= reach;
    high.array() += reach;
    // A triangle near the guides' box may still be far from every guide; the distance of each drawn root decides that.
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
      const auto& [a, b, c] = mesh.triangles[t];
      const Vec3f &x = mesh.vertices[a], &y = mesh.vertices[b], &z = mesh.vertices[c];
      const Vec3f triangle_low = x.cwiseMin(y).cwiseMin(z), triangle_high = x.cwiseMax(y).cwiseMax(z);
      if ((triangle_high.array() < low.array()).any() || (triangle_low.array() > high.array()).any()) continue;
      area_ += static_cast<double>((y - x).cross(z - x).norm()) / 2;
      triangles_.push_back(t);
      areas_.push_back(area_);
    }
  }

  [[nodiscard]] bool empty() const { return !(area_ > 0); }
  Vec3f draw(Random& random) const {
    const auto chosen = std::ranges::upper_bound(areas_, random.unit() * area_);
    const auto t = std::min(static_cast<std::size_t>(chosen - areas_.begin()), triangles_.size() - 1);
    const auto& [a, b, c] = mesh_.triangles[triangles_[t]];
    auto u = static_cast<float>(random.unit()), v = static_cast<float>(random.unit());
    // Points beyond the diagonal are mirrored into the triangle, which keeps the spread even.
    if (u + v > 1) {
      u = 1 - u;
      v = 1 - v;
    }
    return mesh_.vertices[a] + u * (mesh_.vertices[b] - mesh_.vertices[a]) +
           v * (mesh_.vertices[c] - mesh_.vertices[a]);
  }

 private:
  const TriangleMesh& mesh_;
  std::vector<std::uint32_t> triangles_;
  // For each triangle, the sum of the areas up to it.
  std::vector<double> areas_;
  double area_ = 0;
};

class Mixer {
 public:
  Mixer(const Groom& groom, std::span<const Guide> guides) : groom_(groom), guides_(guides) {
    for (const Guide& guide : guides) lengths_.push_back(lengths_along(groom.strand_points(guide.strand)));
  }

  // Makes the strand at `root` from the nearest guides. Each guide's offsets from its root are rotated from the guide's
  // `out` to the root's `out`, so that hair follows the curve of the skull.
  void mix(const Vec3f& root, const Vec3f& out, const Nearest& nearest, std::vector<Vec3f>& strand) const {
    std::array<float, kGuidesPerStrand> weight{};
    std::array<Eigen::Quaternionf, kGuidesPerStrand> turn;
    float sum = 0;
    std::size_t count = 2;
    for (std::size_t k = 0; k < kGuidesPerStrand; ++k) {
      const Guide& guide = guides_[nearest.guide[k]];
      turn[k] = rotation_between(guide.out, out);
      if (guide.way.dot(guides_[nearest.guide[0]].way) < kSameWay) continue;
      // The small addend keeps a root that lies on a guide finite.
      weight[k] = 1 / (nearest.distance2[k] + 1e-8f);
      sum += weight[k];
      count = std::max(count, groom_.strand_points(guide.strand).size());
    }
    count = std::min(count, kPointsMax);
    strand.assign(count, root);
    for (std::size_t i = 1; i < count; ++i) {
      const float share = static_cast<float>(i) / static_cast<float>(count - 1);
      for (std::size_t k = 0; k < kGuidesPerStrand; ++k) {
        if (weight[k] == 0) continue;
        const std::size_t g = nearest.guide[k];
        const Vec3f along = point_at(groom_.strand_points(guides_[g].strand), lengths_[g], share) - guides_[g].root;
        strand[i] += weight[k] / sum * (turn[k] * along);
      }
    }
  }

 private:
  const Groom& groom_;
  std::span<const Guide> guides_;
  std::vector<std::vector<float>> lengths_;
};

}  // namespace

// The filled strands are appended behind the guides, which stay as they are.
Result<void> fill_strands(std::size_t strand_count, Groom& groom) {
  if (!groom.threads.empty() || !groom.cards.empty() || !groom.cloths.empty() || !groom.clumps.empty())
    return Refusal("only strands are filled, and the groom has other things too");
  if (strand_count <= groom.strand_count())
    return Refusal("there are " + std::to_string(groom.strand_count()) + " strands already: --fill takes more");
  if (groom.body.mesh.vertices.empty()) return Refusal("there is no skin to fill");
  // Outwards is away from the middle of the skin that has hair on it. The point is about the middle of a skull above
  // its joint; only directions from it matter, so it need not be exact.
  const Vec3f above_joint(0, 0.06f, 0);
  const std::vector<Guide> guides = guides_of(groom, above_joint);
  if (guides.size() < kGuidesPerStrand)
    return Refusal(std::to_string(guides.size()) + " strands begin on the skin: filling takes 3 or more");
  const Roots roots(guides);
  const float reach = reach_of(guides, roots);
  const SkinSampler skin(groom.body.mesh, guides, reach);
  if (skin.empty()) return Refusal("there is no skin about the roots");

  const double hairs = [&] {
    double sum = 0;
    for (const StrandProperties& strand : groom.strands) sum += static_cast<double>(strand.hair_count);
    return sum;
  }();
  const Mixer mixer(groom, guides);
  Groom filled = groom;
  Random random(1);
  std::vector<Vec3f> strand;
  // A root is drawn often where guides cover little of the skin around them. The limit of tries ends the search where
  // they cover almost nothing.
  const std::size_t tries_max = 100 * strand_count;
  for (std::size_t tries = 0; filled.strand_count() < strand_count; ++tries) {
    if (tries == tries_max) return Refusal("the roots cover too little of the skin to fill");
    const Vec3f root = skin.draw(random);
    const Nearest nearest = roots.nearest_to(root);
    if (!(nearest.distance2[0] <= reach * reach)) continue;
    mixer.mix(root, (root - above_joint).normalized(), nearest, strand);
    if (filled.points.size() + strand.size() > GroomLimits{}.point_count_max)
      return Refusal("the strands would have more than the " + std::to_string(GroomLimits{}.point_count_max) +
                     " points of a groom: fill with fewer");
    filled.add_strand(strand, groom.strands[guides[nearest.guide[0]].strand]);
  }
  // All hairs of the guides are shared again, so filling does not change the number of hairs on the head.
  for (StrandProperties& each : filled.strands)
    each.hair_count = static_cast<float>(hairs / static_cast<double>(filled.strand_count()));
  groom = std::move(filled);
  return {};
}

}  // namespace hairnet
