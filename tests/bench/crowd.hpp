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
  // The steps of a tick and the iterations of a step. As in WorldDef, 0 means those that servers use.
  int substeps = 0, iterations = 0;
  std::size_t threads = 1;
};

// Characters of one level in a world. All play the same motion, and each starts at another time of it.
class Crowd {
 public:
  // `run_s` is how much of the motion will be stepped; it bounds the start times (start_time_s). `motion` must outlive
  // the crowd.
  Crowd(std::shared_ptr<const LevelSet> levels, const Motion& motion, const CrowdSpec& spec, double run_s);

  // Steps one tick, and returns the seconds that World::step took.
  double tick();
  [[nodiscard]] std::string hash() const;
  // Returns how many characters were stepped in the last tick.
  [[nodiscard]] std::uint32_t stepped() const { return report_.stepped; }
  // Returns how many lattices were reset in all ticks. The benchmark takes any for an error.
  [[nodiscard]] std::uint32_t resets() const { return resets_; }

 private:
  const Motion& motion_;
  CrowdSpec spec_;
  server::WorkerPool workers_;
  World world_;
  std::vector<CharacterId> ids_;
  // The time of the motion at which each character starts.
  std::vector<double> starts_s_;
  std::size_t ticks_ = 0;
  StepReport report_;
  std::uint32_t resets_ = 0;
};

}  // namespace hairnet::bench
