#pragma once

#include <memory>
#include <vector>

#include "core/levels/build.hpp"
#include "core/pose/motion.hpp"
#include "tests/bench/options.hpp"
#include "tests/bench/report.hpp"

namespace hairnet::bench {

// The hairstyle and the motions that everything is measured on.
struct Subject {
  Groom groom;
  std::vector<Motion> motions;
};
Result<Subject> load_subject(const Options& options);

}  // namespace hairnet::bench
