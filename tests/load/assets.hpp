#pragma once

#include <vector>

#include "core/result.hpp"
#include "tests/load/motion_bank.hpp"
#include "tests/load/plan.hpp"
#include "tests/load/protocol_client.hpp"

namespace hairnet::load {

// What a plan's names stand for, loaded once for all runs of it.
struct Assets {
  std::vector<EncodedGroom> grooms;
  MotionBank motions;
};
Result<Assets> load_assets(const Plan& plan);

}  // namespace hairnet::load
