#include "core/learnt/learnt_hair.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>

#include "core/learning/network.hpp"
#include "core/random.hpp"
#include "tests/support/learnt.hpp"

namespace hairnet {
namespace {

Pose random_pose(Random& random, double size) {
  const auto vector = [&] { return Vec3(size * Vec3(random.symmetric(), random.symmetric(), random.symmetric())); };
  const auto turn = [&] {
    const Vec3 v = 0.3 * vector();
    return Quat(1, v.x(), v.y(), v.z()).normalized();
  };
  Pose pose = rigid_pose({turn(), 0.1 * vector()});
  for (std::size_t bone = 1; bone < kBoneCount; ++bone) {
    pose.bones[bone] = pose.bones[bone] * RigidTransform{turn(), 0.02 * vector()};
  }
  return pose;
}

// Evaluates the equations of LearntHair (learnt_hair.hpp) one after the other, in doubles. `h` is the hidden state,
// which is replaced.
std::vector<double> reference_step(const LearntHair& hair, const PoseInputs& x, const Vec3& air_head,
                                   std::vector<double>& h) {
  const std::size_t n = hair.hidden_count;
  const auto f = [](double a) {
    a = std::clamp(a, -3.0, 3.0);
    return a * (27 + a * a) / (27 + 9 * a * a);
  };
  const auto s = [&](double a) { return 0.5 * (1 + f(a)); };
  const auto of_inputs = [&](std::size_t row) {
    double sum =
        std::inner_product(x.begin(), x.end(), hair.input_weights.begin() + static_cast<long>(row * x.size()), 0.0);
    for (std::size_t i = 0; i < hair.wind.weights.size() / (3 * n); ++i)
      sum += static_cast<double>(hair.wind.weights[3 * row + i]) * air_head[static_cast<int>(i)];
    return sum;
  };
  const auto of_hidden = [&](std::size_t row) {
    return std::inner_product(h.begin(), h.end(), hair.hidden_weights.begin() + static_cast<long>(row * n), 0.0);
  };
  std::vector<double> after(n), c(hair.mode_count);
  for (std::size_t i = 0; i < n; ++i) {
    const auto bias = [&](std::size_t gate) { return static_cast<double>(hair.bias[gate * n + i]); };
    const double z = s(of_inputs(i) + of_hidden(i) + bias(0));
    const double r = s(of_inputs(2 * n + i) + of_hidden(2 * n + i) + bias(2));
    const double target = f(of_inputs(n + i) + r * of_hidden(n + i) + bias(1)) - f(bias(1));
    after[i] = h[i] + z * (target - h[i]);
  }
  h = after;
  for (std::size_t k = 0; k < c.size(); ++k) {
    c[k] = std::inner_product(h.begin(), h.end(), hair.output_weights.begin() + static_cast<long>(k * n), 0.0);
  }
  return c;
}

TEST(PoseHistory, gives_zeros_for_an_upright_head_that_stands_still_anywhere) {
  PoseHistory history;
  const Pose pose = rigid_pose({Quat(Eigen::AngleAxisd(2, Vec3::UnitY())), Vec3(3, 1, -400)});
  for (int tick = 0; tick < 5; ++tick) {
    for (const float input : history.next(pose)) EXPECT_NEAR(input, 0, 1e-6);
  }
  PoseHistory at_rest;
  for (int tick = 0; tick < 5; ++tick) EXPECT_EQ(at_rest.next({}), PoseInputs{});
}

// The network is trained at one place. Hair must move alike wherever a person stands and whichever way they look.
TEST(PoseHistory, does_not_depend_on_place_and_heading) {
  const RigidTransform elsewhere{Quat(Eigen::AngleAxisd(-1, Vec3::UnitY())), Vec3(20, -3, 5)};
  Random random(1);
  PoseHistory here, there;
  for (int tick = 0; tick < 10; ++tick) {
    Pose pose = random_pose(random, 1);
    const PoseInputs expected = here.next(pose);
    for (RigidTransform& bone : pose.bones) bone = elsewhere * bone;
    const PoseInputs inputs = there.next(pose);
    for (std::size_t i = 0; i < inputs.size(); ++i) EXPECT_NEAR(inputs[i], expected[i], 1e-4) << i;
  }
}

TEST(PoseHistory, measures_velocity_acceleration_and_spin_in_the_axes_of_the_head) {
  PoseHistory history;
  PoseInputs inputs{};
  // The head looks along +X.
  const Quat sideways(Eigen::AngleAxisd(std::numbers::pi / 2, Vec3::UnitY()));
  for (int tick = 0; tick < 4; ++tick) {
    const double time_s = tick * kLearntTick_s;
    inputs = history.next(rigid_pose({sideways, Vec3(0.5 * 9.81 * time_s * time_s, 0, 0)}));
    if (tick < 2) {
      EXPECT_EQ(inputs[8], 0) << "an acceleration needs three poses";
    }
  }
  // The inputs 3 to 5 are the velocity and 6 to 8 the acceleration over gravity, each x, y, z in the axes of the head,
  // whose z is its face. The mean velocity over the last tick is the velocity 2.5 ticks after the start.
  EXPECT_NEAR(inputs[5], 9.81 * 2.5 * kLearntTick_s, 1e-4);
  EXPECT_NEAR(inputs[8], 1, 1e-4);
  PoseHistory turning;
  for (int tick = 0; tick < 4; ++tick) {
    const Quat turn(Eigen::AngleAxisd(0.6 * tick * kLearntTick_s, Vec3::UnitX()));
    inputs = turning.next(rigid_pose({turn, Vec3::Zero()}));
  }
  // The inputs 9 to 11 are the angular velocity, rad/s.
  EXPECT_NEAR(inputs[9], 0.6, 1e-3);
  EXPECT_NEAR(inputs[10], 0, 1e-6);
}

TEST(PoseHistory, knows_where_the_body_is) {
  Pose pose;
  pose[Bone::left_shoulder].position = Vec3(0, 0.03, 0);
  PoseHistory history;
  PoseInputs inputs = history.next(pose);
  // Input 19 is how far the left shoulder is above its place, in decimetres.
  EXPECT_NEAR(inputs[19], 0.3, 1e-6);
  inputs[19] = 0;
  EXPECT_EQ(inputs, PoseInputs{});
}

TEST(PoseHistory, takes_the_pose_after_a_teleport_as_still) {
  PoseHistory history;
  history.next({});
  history.next({});
  const PoseInputs inputs = history.next(rigid_pose({Quat::Identity(), Vec3(100, 0, 0)}));
  EXPECT_EQ(inputs, PoseInputs{});
}

TEST(LearntHair, agrees_with_the_reference) {
  for (const auto& [hidden, modes] : {std::pair{4, 4}, {20, 12}, {48, 32}, {128, 128}}) {
    LearntHair hair = support::random_learnt_hair(3, static_cast<std::size_t>(hidden), static_cast<std::size_t>(modes));
    // One network has learnt nothing of wind.
    if (hidden == 20) hair.wind = {};
    ASSERT_EQ(validate(hair), "");
    Random random(4);
    LearntState state;
    PoseHistory history;
    std::vector<float> c(hair.mode_count);
    for (int tick = 0; tick < 30; ++tick) {
      const Pose pose = random_pose(random, 1);
      std::vector<double> h(state.hidden.begin(), state.hidden.end());
      h.resize(hair.hidden_count);
      const Vec3 air_world(9 * random.symmetric(), 2, 9 * random.symmetric());
      LearntMember member{&state, &pose, c, air_world};
      step_learnt(hair, {&member, 1});
      const Vec3 air_head = pose.head().rotation.conjugate() * air_world;
      const std::vector<double> expected = reference_step(hair, history.next(pose), air_head, h);
      for (std::size_t i = 0; i < h.size(); ++i) EXPECT_NEAR(state.hidden[i], h[i], 1e-5);
      for (std::size_t k = 0; k < c.size(); ++k) EXPECT_NEAR(c[k], expected[k], 1e-5);
    }
  }
}

TEST(LearntHair, is_the_same_alone_and_in_a_crowd) {
  const LearntHair hair = support::random_learnt_hair(5);
  std::vector<LearntState> crowd(kLearntWidth), alone(kLearntWidth);
  std::vector<std::vector<float>> c(kLearntWidth, std::vector<float>(hair.mode_count));
  std::vector<float> own(hair.mode_count);
  Random random(6);
  for (int tick = 0; tick < 20; ++tick) {
    std::vector<Pose> poses;
    std::vector<LearntMember> members;
    for (std::size_t n = 0; n < kLearntWidth; ++n) poses.push_back(random_pose(random, 1));
    for (std::size_t n = 0; n < kLearntWidth; ++n) members.push_back({&crowd[n], &poses[n], c[n]});
    if (tick % 2 == 1) std::ranges::reverse(members);
    step_learnt(hair, members);
    for (std::size_t n = 0; n < kLearntWidth; ++n) {
      LearntMember member{&alone[n], &poses[n], own};
      step_learnt(hair, {&member, 1});
      EXPECT_EQ(own, c[n]);
      EXPECT_EQ(alone[n].hidden, crowd[n].hidden);
    }
  }
}

// Hair that is nearly at rest would tremble forever and never fall asleep.
TEST(LearntHair, of_a_still_upright_head_is_exactly_at_rest) {
  const LearntHair hair = support::random_learnt_hair(7);
  const Pose pose;
  LearntState state;
  std::vector<float> c(hair.mode_count + 5, 1);
  for (int tick = 0; tick < 10; ++tick) {
    LearntMember member{&state, &pose, c};
    step_learnt(hair, {&member, 1});
    EXPECT_TRUE(member.is_covered);
    EXPECT_TRUE(std::ranges::all_of(c, [](float value) { return value == 0; }));
  }
}

TEST(LearntHair, stays_bounded_far_outside_its_range_and_says_so) {
  const LearntHair hair = support::random_learnt_hair(8);
  LearntState state;
  std::vector<float> c(hair.mode_count);
  double most = 0;
  // A hidden number stays within -2 and 2, as the difference of two values of f, which is within -1 and 1.
  for (const float weight : hair.output_weights) most += 2 * std::abs(static_cast<double>(weight));
  for (int tick = 0; tick < 300; ++tick) {
    // The head turns 6 times a second (40 rad/s) and moves at 20 m/s.
    const Pose pose = rigid_pose(
        {Quat(Eigen::AngleAxisd(40 * tick * kLearntTick_s, Vec3::UnitY())), Vec3(20 * tick * kLearntTick_s, 0, 0)});
    LearntMember member{&state, &pose, c};
    step_learnt(hair, {&member, 1});
    EXPECT_TRUE(tick == 0 || !member.is_covered);
    for (const float value : c) EXPECT_LE(std::abs(value), most);
  }
}

TEST(LearntHair, covers_inputs_of_the_size_met_in_training) {
  LearntHair hair = support::random_learnt_hair(9);
  PoseInputs inputs{};
  EXPECT_TRUE(hair.covers(inputs));
  // random_learnt_hair() says that training met inputs of up to 10. A tenth more still counts as covered (kMargin in
  // learnt_hair.cpp).
  inputs[3] = -10;
  EXPECT_TRUE(hair.covers(inputs));
  inputs[3] = -15;
  EXPECT_FALSE(hair.covers(inputs));
  inputs[3] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_FALSE(hair.covers(inputs));
}

TEST(LearntHair, covers_air_as_fast_as_in_training) {
  LearntHair hair = support::random_learnt_hair(9);
  hair.wind.max_m_per_s = 10;
  const Pose pose;
  std::vector<float> c(hair.mode_count);
  const auto is_covered = [&](const Vec3& air_world) {
    LearntState state;
    LearntMember member{&state, &pose, c, air_world};
    step_learnt(hair, {&member, 1});
    return member.is_covered;
  };
  // This air has a speed of 10 m/s, the fastest of training; the next has 12.7 m/s.
  EXPECT_TRUE(is_covered({6, 0, -8}));
  EXPECT_FALSE(is_covered({9, 0, -9}));
  EXPECT_FALSE(is_covered({0, std::numeric_limits<double>::quiet_NaN(), 0}));
  hair.wind.weights.clear();
  EXPECT_TRUE(is_covered(Vec3::Zero()));
  EXPECT_FALSE(is_covered({0.1, 0, 0}));
}

TEST(LearntHair, with_an_error_is_not_valid) {
  const LearntHair good = support::random_learnt_hair(10);
  const auto error = [&](auto corrupt) {
    LearntHair hair = good;
    corrupt(hair);
    return validate(hair);
  };
  EXPECT_EQ(validate(good), "");
  EXPECT_NE(validate(LearntHair{}), "");
  // Counts must be multiples of 4, and at most 128 (kLearntHiddenMax, kLearntModesMax).
  EXPECT_NE(error([](LearntHair& h) { h.hidden_count = 18; }), "");
  EXPECT_NE(error([](LearntHair& h) { h.hidden_count = 256; }), "");
  EXPECT_NE(error([](LearntHair& h) { h.mode_count = 132; }), "");
  EXPECT_NE(error([](LearntHair& h) { h.input_weights.pop_back(); }), "");
  EXPECT_NE(error([](LearntHair& h) { h.hidden_weights.push_back(0); }), "");
  EXPECT_NE(error([](LearntHair& h) { h.bias.clear(); }), "");
  EXPECT_NE(error([](LearntHair& h) { h.output_weights[3] = std::numeric_limits<float>::infinity(); }), "");
  EXPECT_NE(error([](LearntHair& h) { h.most[0] = -1; }), "");
  EXPECT_NE(error([](LearntHair& h) { h.error = std::numeric_limits<float>::quiet_NaN(); }), "");
  EXPECT_NE(error([](LearntHair& h) { h.wind.weights.pop_back(); }), "");
  // The largest weight is kLearntWeightMax = 1e6.
  EXPECT_NE(error([](LearntHair& h) { h.wind.weights[2] = 2e6f; }), "");
  EXPECT_NE(error([](LearntHair& h) { h.wind.max_m_per_s = -1; }), "");
  EXPECT_NE(error([](LearntHair& h) { h.wind.low_error = std::numeric_limits<float>::infinity(); }), "");
}

// The loss is the sum of all outputs of six ticks, each times a random factor. Its gradient by the weights must equal
// central differences.
TEST(Network, has_the_gradient_that_differences_find) {
  const NetworkSize size{5, 4, 3};
  using Matrix = Network<double>::Matrix;
  using Vector = Network<double>::Vector;
  Random random(11);
  const auto fill = [&](auto& m, double scale) {
    for (double& value : m.reshaped()) value = scale * random.bell();
  };
  constexpr Eigen::Index kWidth = 2, kTicks = 6;
  Vector weights(size.weight_count());
  Matrix inputs(size.inputs, kTicks * kWidth), factors(size.outputs, kTicks * kWidth), start(size.hidden, kWidth);
  fill(weights, 0.5);
  fill(inputs, 1);
  fill(factors, 1);
  fill(start, 0.3);
  Network<double> network(size);
  const auto loss = [&](const Vector& w) {
    Matrix h = start;
    return network.forward(w, inputs, h).cwiseProduct(factors).sum();
  };
  loss(weights);
  Vector gradient = Vector::Zero(weights.size());
  network.backward(weights, inputs, factors, gradient);
  constexpr double kStep = 1e-5;
  for (Eigen::Index i = 0; i < weights.size(); ++i) {
    Vector more = weights, less = weights;
    more[i] += kStep;
    less[i] -= kStep;
    EXPECT_NEAR(gradient[i], (loss(more) - loss(less)) / (2 * kStep), 1e-6) << i;
  }
}

TEST(Network, goes_on_from_the_state_in_which_it_stopped) {
  const NetworkSize size{kPoseInputCount, 8, 4};
  using Matrix = Network<float>::Matrix;
  Network<float>::Vector weights = Network<float>::Vector::Constant(size.weight_count(), 0.1f);
  const Matrix inputs = Matrix::Constant(size.inputs, 12, 0.3f);
  Network<float> network(size);
  Matrix whole_h = Matrix::Zero(size.hidden, 2), h = whole_h;
  const Matrix whole = network.forward(weights, inputs, whole_h);
  network.forward(weights, inputs.leftCols(8), h);
  EXPECT_EQ(network.forward(weights, inputs.rightCols(4), h), whole.rightCols(4));
  EXPECT_EQ(h, whole_h);
}

}  // namespace
}  // namespace hairnet
