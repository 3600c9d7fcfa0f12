#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/learning/learnt_examples.hpp"
#include "core/learnt/learnt_hair.hpp"

namespace hairnet {

// What the finest and the low level do in motions from which nothing is learnt; `motion_count` is rounded up to whole
// thirty-twos. Empty when `keep_going` returns false.
std::vector<LearntExamples> take_validation_examples(const Groom& groom, const std::shared_ptr<const LevelSet>& levels,
                                                     const Modes& modes, std::uint32_t motion_count,
                                                     std::size_t tick_count,
                                                     const std::function<bool(double)>& keep_going,
                                                     const ParallelFor& parallel_for);
// Measures the errors of the hair and of the low level in the validation examples. Hair that errs more than the low
// level in wind loses the weights of the wind. Returns one line when the hair errs more than the low level in still
// air, or is not valid; else an empty string.
std::string judge(const std::vector<LearntExamples>& validation, LearntHair& hair);

}  // namespace hairnet
