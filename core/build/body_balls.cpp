#include "core/build/body_balls.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/build/reachable_skin.hpp"

namespace hairnet {
namespace {

constexpr double kBoneWeightLeast = 0.3;                  // of a bone, for skin to count as moved by it
constexpr double kRadiusLeast = 0.02, kRadiusMost = 0.2;  // m, of a ball inscribed in the skin
constexpr double kInscribedSlack = 0.05;                  // of the radius: facets are no smooth skin
constexpr double kRadiusOfInscribed = 1.15;               // the typical distance to the skin is more than the least
constexpr int kShrinkRounds = 12;
constexpr std::size_t kSkinPerCandidate = 3;
constexpr double kGainLeast = 0.0007;   // m of error: a further ball that takes less away is not worth its time
constexpr double kErrorEnough = 0.005;  // m
constexpr double kErrorMost = 0.1;      // m, of skin that no ball stands for
constexpr double kSlopeMost_rad = 1.05;
// How far hair slides along the skin, m: on the head that carries it, and on a trunk that turns under it.
constexpr double kSlideOnHead = 0.04, kSlideOnTrunk = 0.1;
// How far skin that two bones share may leave the one when it follows the other, m.
constexpr double kShouldersFromTrunk = 0.02, kHeadFromNeck = 0.03;

struct Candidate {
  Bone bone;
  Vec3 centre;
  double radius;
};

// A place on the skin as one of its bones moves it: what a ball on that bone should stand for.
struct Target {
  Vec3 point, normal;
  Bone bone;
  double weight;
};

std::vector<Target> make_targets(const std::vector<SkinPoint>& skin) {
  std::vector<Target> targets;
  for (const SkinPoint& s : skin) {
    for (std::size_t b = 0; b < kBoneCount; ++b) {
      if (s.bone_weights[b] < kBoneWeightLeast) continue;
      targets.push_back({s.point, s.normal, static_cast<Bone>(b), s.weight * s.bone_weights[b]});
    }
  }
  return targets;
}

const SkinPoint* nearest_within(const std::vector<SkinPoint>& skin, const Vec3& centre, double radius) {
  const SkinPoint* nearest = nullptr;
  double nearest2 = std::pow((1 - kInscribedSlack) * radius, 2);
  for (const SkinPoint& s : skin) {
    const double distance2 = (s.point - centre).squaredNorm();
    if (distance2 >= nearest2) continue;
    nearest2 = distance2;
    nearest = &s;
  }
  return nearest;
}

// The largest ball inside that touches the skin at `from`, found by shrinking (Ma, Bae and Choi 2012): as long as
// another point of the skin lies within, the ball is made to pass through that one.
double inscribed_radius(const std::vector<SkinPoint>& skin, const SkinPoint& from) {
  double radius = kRadiusMost;
  for (int round = 0; round < kShrinkRounds; ++round) {
    const SkinPoint* within = nearest_within(skin, from.point - radius * from.normal, radius);
    if (!within) break;
    const Vec3 chord = from.point - within->point;
    const double along = chord.dot(from.normal);
    if (along <= 1e-9) break;
    radius = chord.squaredNorm() / (2 * along);
  }
  return radius;
}

std::vector<Candidate> make_candidates(const std::vector<SkinPoint>& skin, const MeshQuery& mesh) {
  std::vector<Candidate> candidates;
  for (std::size_t i = 0; i < skin.size(); i += kSkinPerCandidate) {
    const double radius = inscribed_radius(skin, skin[i]);
    const Vec3 centre = skin[i].point - radius * skin[i].normal;
    if (radius < kRadiusLeast || !mesh.inside(centre)) continue;
    for (std::size_t b = 0; b < kBoneCount; ++b) {
      if (skin[i].bone_weights[b] < kBoneWeightLeast) continue;
      candidates.push_back({static_cast<Bone>(b), centre, kRadiusOfInscribed * radius});
    }
  }
  return candidates;
}

double apart(Bone a, Bone b) {
  if (a == b) return 0;
  if (a != Bone::head && b != Bone::head) return kShouldersFromTrunk;
  return a == Bone::neck || b == Bone::neck ? kHeadFromNeck : kErrorMost;
}

// What the ball is off by at a target after hair has slid there: radii are fitted in every direction, so that only the
// ball's slope against the skin counts. kErrorMost for skin that it does not face or reach.
double error_at(const Candidate& ball, const Target& target) {
  static const double least_cosine = std::cos(kSlopeMost_rad);
  const Vec3 r = target.point - ball.centre;
  const double distance = r.norm(), ratio = distance / ball.radius;
  if (ratio < kSkinRatioLeast || ratio > kSkinRatioMost) return kErrorMost;
  const double cosine = r.dot(target.normal) / distance;
  if (cosine < least_cosine) return kErrorMost;
  const double slide = ball.bone == Bone::head ? kSlideOnHead : kSlideOnTrunk;
  return std::min(kErrorMost, slide * std::sqrt(std::max(0.0, 1 - cosine * cosine)) + apart(ball.bone, target.bone));
}

// The balls chosen, by the root of the mean squared error that the best of them leaves at each target.
class Choice {
 public:
  Choice(const std::vector<Candidate>& candidates, const std::vector<Target>& targets) {
    for (const Candidate& c : candidates) {
      std::vector<float>& squares = squares_.emplace_back();
      for (const Target& t : targets) squares.push_back(static_cast<float>(std::pow(error_at(c, t), 2)));
    }
    for (const Target& t : targets) weights_.push_back(static_cast<float>(t.weight));
  }

  [[nodiscard]] double error(const std::vector<std::size_t>& chosen) const {
    const std::vector<float> left = squares_left(chosen);
    double sum = 0, weight = 0;
    for (std::size_t t = 0; t < left.size(); ++t) {
      sum += static_cast<double>(weights_[t] * left[t]);
      weight += static_cast<double>(weights_[t]);
    }
    return std::sqrt(sum / weight);
  }

  // The candidate that takes most away from what `chosen` leave.
  [[nodiscard]] std::size_t best_addition(const std::vector<std::size_t>& chosen) const {
    const std::vector<float> left = squares_left(chosen);
    std::size_t best = 0;
    float least = std::numeric_limits<float>::infinity();
    for (std::size_t c = 0; c < squares_.size(); ++c) {
      float sum = 0;
      for (std::size_t t = 0; t < left.size(); ++t) sum += weights_[t] * std::min(left[t], squares_[c][t]);
      if (sum >= least) continue;
      least = sum;
      best = c;
    }
    return best;
  }

 private:
  [[nodiscard]] std::vector<float> squares_left(const std::vector<std::size_t>& chosen) const {
    std::vector<float> left(weights_.size(), static_cast<float>(kErrorMost * kErrorMost));
    for (const std::size_t c : chosen) {
      for (std::size_t t = 0; t < left.size(); ++t) left[t] = std::min(left[t], squares_[c][t]);
    }
    return left;
  }

  std::vector<std::vector<float>> squares_;  // m^2, [candidate][target]
  std::vector<float> weights_;
};

// One more, then each once more in turn: those chosen for want of the later ones may stand better elsewhere.
std::vector<std::size_t> with_one_more(const Choice& choice, std::vector<std::size_t> chosen) {
  chosen.push_back(choice.best_addition(chosen));
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    chosen.erase(chosen.begin());
    chosen.push_back(choice.best_addition(chosen));
  }
  return chosen;
}

std::vector<std::size_t> choose(const Choice& choice) {
  std::vector<std::size_t> chosen;
  double error = choice.error(chosen);
  while (chosen.size() < kBallCountMost && error > kErrorEnough) {
    std::vector<std::size_t> more = with_one_more(choice, chosen);
    const double less = choice.error(more);
    if (error - less < kGainLeast) break;
    chosen = std::move(more);
    error = less;
  }
  return chosen;
}

}  // namespace

BodyBall::BodyBall(const MeshQuery& skin, Bone of, const Vec3& c, double r)
    : bone(of), centre(c.cast<float>().cast<double>()), radius(r), profile(skin, centre, radius) {}

BodyShape place_balls(const Groom& groom) {
  BodyShape shape{MeshQuery(groom.body.mesh), {}, sample_hair(groom)};
  const std::vector<SkinPoint> skin = reachable_skin(groom, shape.hair, shape.skin);
  const std::vector<Candidate> candidates = make_candidates(skin, shape.skin);
  if (candidates.empty()) return shape;
  for (const std::size_t chosen : choose(Choice(candidates, make_targets(skin)))) {
    const Candidate& c = candidates[chosen];
    shape.balls.emplace_back(shape.skin, c.bone, c.centre, c.radius);
  }
  std::ranges::stable_sort(shape.balls, {}, &BodyBall::bone);
  return shape;
}

}  // namespace hairnet
