#pragma once

#include <vector>

#include "core/result.hpp"
#include "tests/load/motion_bank.hpp"
#include "tests/load/peer.hpp"
#include "tests/load/plan.hpp"

namespace hairnet::load {

// What a plan's names stand for, loaded once for all runs of it.
struct Assets {
  std::vector<EncodedGroom> grooms;
  MotionBank motions;
};
Result<Assets> load_assets(const Plan& plan);

}  // namespace hairnet::load
