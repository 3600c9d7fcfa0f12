#pragma once

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/learning/learnt_examples.hpp"
#include "core/learning/network.hpp"
#include "core/learnt/learnt_hair.hpp"

namespace hairnet {

NetworkSize size_of(const LearntHair& hair);
// The weights of the hair as Network has them. Without weights of the wind these are 0.
Eigen::VectorXf weights_of(const LearntHair& hair);
// Shortens the weights to 8 bits after the first, with which a network errs as much and its file is packed into two
// thirds of the bytes, and makes them the hair's, with its counts.
void set_weights(const NetworkSize& size, Eigen::VectorXf weights, LearntHair& hair);

// What the finest and the low level do in motions from which nothing is learnt; `motion_count` is rounded up to whole
// thirty-twos. Empty when `keep_going` returns false.
std::vector<LearntExamples> take_held_out(const Groom& groom, const std::shared_ptr<const LevelSet>& levels,
                                          const Modes& modes, std::uint32_t motion_count, std::size_t tick_count,
                                          const std::function<bool(double)>& keep_going,
                                          const ParallelFor& parallel_for);
// Measures the errors of the hair and of the low level on them. Hair that errs more than the low level in wind loses
// the weights of the wind. Returns a line about the fault of hair that does so in still air, or is not valid; else an
// empty string.
std::string judge(const std::vector<LearntExamples>& held_out, LearntHair& hair);

std::uint32_t whole_thirty_twos(std::uint32_t count);

}  // namespace hairnet
