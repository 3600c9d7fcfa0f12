#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/pose/motion.hpp"
#include "core/world/world.hpp"
#include "server/threading/worker_pool.hpp"

namespace hairnet::bench {

struct CrowdSpec {
  LevelIndex level = LevelIndex::high;
  std::size_t count = 0;
  double rate_hz = 25;
  // As in WorldDef, 0 means what is shipped.
  int substeps = 0, iterations = 0;
  std::size_t threads = 1;
};

// Characters of one level in a world, each elsewhere in the same motion.
class Crowd {
 public:
  // `run_s`: how much of the motion will be stepped. `motion` must outlive it.
  Crowd(std::shared_ptr<const LevelSet> levels, const Motion& motion, const CrowdSpec& spec, double run_s);

  // Steps one tick, and returns the seconds that World::step took.
  double tick();
  [[nodiscard]] std::string hash() const;
  [[nodiscard]] std::uint32_t stepped() const { return report_.stepped; }  // in the last tick
  [[nodiscard]] std::uint32_t resets() const { return resets_; }

 private:
  const Motion& motion_;
  CrowdSpec spec_;
  server::WorkerPool workers_;
  World world_;
  std::vector<CharacterId> ids_;
  std::vector<double> starts_s_;
  std::size_t ticks_ = 0;
  StepReport report_;
  std::uint32_t resets_ = 0;
};

}  // namespace hairnet::bench
