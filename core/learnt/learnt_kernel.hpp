#pragma once

#include "core/learnt/learnt_hair.hpp"

namespace hairnet {

// The network for kLearntWidth characters, compiled for several instruction sets; the first call picks the best one for
// the machine. All arrays are [number][character] and aligned to 64 bytes. `inputs`: of the pose, then of the air.
void learnt_kernel(const LearntHair& hair, const float* inputs, const float* hidden, float* hidden_out,
                   float* coefficients_out);

}  // namespace hairnet
