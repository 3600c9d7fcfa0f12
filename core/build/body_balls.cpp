#include "core/build/body_balls.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <cstdio>
#include <limits>

#include "core/build/reachable_skin.hpp"

namespace hairnet {
namespace {

double env(const char* n, double d) { const char* v = std::getenv(n); return v ? std::atof(v) : d; }

constexpr double kBoneWeightLeast = 0.3;  // of a bone, for skin to count as moved by it
const double kErrorMost = env("HN_EM", 0.1);      // m: skin that no ball stands for lets hair in this far
constexpr double kRadiusLeast = 0.02, kRadiusMost = 0.2;  // m
constexpr int kShrinkRounds = 12;
constexpr int kReplaceRounds = 2;

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

// The largest ball inside that touches the skin at `from`, found by shrinking (Ma, Bae and Choi 2012): as long as
// another point of the skin lies within, the ball is made to pass through that one.
double inscribed_radius(const std::vector<SkinPoint>& skin, const SkinPoint& from) {
  double radius = kRadiusMost;
  for (int round = 0; round < kShrinkRounds; ++round) {
    const Vec3 centre = from.point - radius * from.normal;
    double nearest2 = radius * radius * (1 - 1e-6);
    const SkinPoint* inside = nullptr;
    for (const SkinPoint& s : skin) {
      const double distance2 = (s.point - centre).squaredNorm();
      if (distance2 < nearest2) {
        nearest2 = distance2;
        inside = &s;
      }
    }
    if (!inside) break;
    const Vec3 chord = from.point - inside->point;
    const double along = chord.dot(from.normal);
    if (along <= 1e-9) break;
    radius = chord.squaredNorm() / (2 * along);
  }
  return radius;
}

std::vector<BodyBall> make_candidates(const std::vector<SkinPoint>& skin, const MeshQuery& mesh) {
  std::vector<BodyBall> candidates;
  for (std::size_t i = 0; i < skin.size(); i += 2) {
    double radius = inscribed_radius(skin, skin[i]);
    const Vec3 centre = skin[i].point - radius * skin[i].normal;
    radius *= env("HN_RS",1.15);
    if (radius < kRadiusLeast || !mesh.inside(centre)) continue;
    for (std::size_t b = 0; b < kBoneCount; ++b) {
      if (skin[i].bone_weights[b] >= kBoneWeightLeast) candidates.push_back({static_cast<Bone>(b), centre, radius});
    }
  }
  return candidates;
}

// How far two bones' shares of the same skin may come apart, m.
double apart(Bone a, Bone b) {
  if (a == b) return 0;
  if (a == Bone::head || b == Bone::head) return a == Bone::neck || b == Bone::neck ? env("HN_APH", 0.03) : kErrorMost;
  return env("HN_APT", 0.02);
}

// What the ball is off by at a target when hair has slid along it by kSlide: radii are fitted to the skin in a node's own
// direction, so that only the ball's slope against the skin's counts. kErrorMost for skin out of its range.
double error_at(const BodyBall& ball, const Target& target) {
  const Vec3 r = target.point - ball.centre;
  const double distance = r.norm(), ratio = distance / ball.radius;
  if (ratio < kRadiusRatioLeast || ratio > kRadiusRatioMost) return kErrorMost;
  const double cosine = r.dot(target.normal) / distance;
  if (cosine <= 0.5) return kErrorMost;
  const double slide = ball.bone == Bone::head ? env("HN_SLIDE", 0.04) : env("HN_SLIDE2", 0.1);
  return std::min(kErrorMost, slide * std::sqrt(std::max(0.0, 1 - cosine * cosine)) + apart(ball.bone, target.bone));
}

std::vector<float> errors_of(const BodyBall& ball, const std::vector<Target>& targets) {
  std::vector<float> errors;
  for (const Target& t : targets) errors.push_back(static_cast<float>(error_at(ball, t)));
  return errors;
}

// Choice of candidates by the squared error that the best ball for each target leaves.
class Choice {
 public:
  Choice(const std::vector<BodyBall>& candidates, const std::vector<Target>& targets) {
    for (const BodyBall& candidate : candidates) errors_.push_back(errors_of(candidate, targets));
    for (const Target& t : targets) weights_.push_back(static_cast<float>(t.weight));
  }

  [[nodiscard]] double error(const std::vector<std::size_t>& chosen) const {
    const std::vector<float> best = best_errors(chosen);
    double sum = 0, weight = 1e-300;
    for (std::size_t t = 0; t < best.size(); ++t) {
      sum += static_cast<double>(weights_[t] * best[t] * best[t]);
      weight += static_cast<double>(weights_[t]);
    }
    return std::sqrt(sum / weight);
  }

  // The candidate that takes most away from the error which `chosen` leave.
  [[nodiscard]] std::size_t best_addition(const std::vector<std::size_t>& chosen) const {
    const std::vector<float> best = best_errors(chosen);
    std::size_t addition = 0;
    float least = std::numeric_limits<float>::infinity();
    for (std::size_t c = 0; c < errors_.size(); ++c) {
      float sum = 0;
      for (std::size_t t = 0; t < best.size(); ++t) {
        const float error = std::min(best[t], errors_[c][t]);
        sum += weights_[t] * error * error;
      }
      if (sum < least) {
        least = sum;
        addition = c;
      }
    }
    return addition;
  }

 private:
  [[nodiscard]] std::vector<float> best_errors(const std::vector<std::size_t>& chosen) const {
    std::vector<float> best(weights_.size(), static_cast<float>(kErrorMost));
    for (const std::size_t c : chosen) {
      for (std::size_t t = 0; t < best.size(); ++t) best[t] = std::min(best[t], errors_[c][t]);
    }
    return best;
  }

  std::vector<std::vector<float>> errors_;  // [candidate][target]
  std::vector<float> weights_;
};

std::vector<std::size_t> choose(const Choice& choice) {
  std::vector<std::size_t> chosen;
  double error = choice.error(chosen);
  while (chosen.size() < static_cast<std::size_t>(env("HN_MAX", 10))) {
    std::vector<std::size_t> more = chosen;
    more.push_back(choice.best_addition(chosen));
    // Earlier ones, chosen for want of the later, may now stand better elsewhere.
    for (int round = 0; round < kReplaceRounds; ++round) {
      for (std::size_t i = 0; i < more.size(); ++i) {
        more.erase(more.begin());
        more.push_back(choice.best_addition(more));
      }
    }
    const double less = choice.error(more);
    if (std::getenv("HN_V")) std::fprintf(stderr, "%zu balls: %.1f mm\n", more.size(), less * 1e3);
    if (less > error - env("HN_GAIN", 0.0007)) break;
    chosen = more;
    error = less;
  }
  return chosen;
}

}  // namespace

BodyShape place_balls(const Groom& groom) {
  BodyShape shape{MeshQuery(groom.body.mesh), {}, sample_hair(groom), {}};
  const std::vector<SkinPoint> skin = reachable_skin(groom, shape.skin);
  const std::vector<BodyBall> candidates = make_candidates(skin, shape.skin);
  if (candidates.empty()) return shape;
  for (const std::size_t c : choose(Choice(candidates, make_targets(skin)))) shape.balls.push_back(candidates[c]);
  std::ranges::stable_sort(shape.balls, {}, &BodyBall::bone);
  return shape;
}

}  // namespace hairnet
