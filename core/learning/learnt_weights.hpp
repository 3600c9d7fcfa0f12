#pragma once

#include <Eigen/Core>

#include "core/learning/network.hpp"
#include "core/learnt/learnt_hair.hpp"

namespace hairnet {

NetworkSize size_of(const LearntHair& hair);
// The weights of the hair as Network has them. Without weights of the wind these are 0.
Eigen::VectorXf weights_of(const LearntHair& hair);
// Shortens the weights to 8 bits after the first, with which a network errs as much and its file is packed into two
// thirds of the bytes, and makes them the hair's, with its counts.
void set_weights(const NetworkSize& size, Eigen::VectorXf weights, LearntHair& hair);

}  // namespace hairnet
