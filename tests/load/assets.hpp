#pragma once

#include <vector>

#include "core/result.hpp"
#include "tests/load/motion_bank.hpp"
#include "tests/load/plan.hpp"
#include "tests/load/protocol_client.hpp"

namespace hairnet::load {

// The assets that a plan names, loaded once for all its runs.
struct Assets {
  std::vector<EncodedGroom> grooms;
  MotionBank motions;
};
Result<Assets> load_assets(const Plan& plan);

}  // namespace hairnet::load
