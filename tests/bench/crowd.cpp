#include "tests/bench/crowd.hpp"

#include <chrono>

#include "tests/bench/state_hash.hpp"
#include "tests/bench/workload.hpp"

namespace hairnet::bench {
namespace {

WorldDef world_def(const CrowdSpec& spec, server::WorkerPool& workers) {
  WorldDef def;
  def.tick_s = 1 / spec.rate_hz;
  def.substep_count = spec.substeps;
  def.iterations = spec.iterations;
  def.parallel_for = [&workers](std::size_t count, const std::function<void(std::size_t)>& body) {
    workers.parallel_for(count, body);
  };
  return def;
}

}  // namespace

Crowd::Crowd(std::shared_ptr<const LevelSet> levels, const Motion& motion, const CrowdSpec& spec, double run_s)
    : motion_(motion), spec_(spec), workers_(spec.threads), world_(world_def(spec, workers_)) {
  for (std::size_t c = 0; c < spec.count; ++c) {
    starts_s_.push_back(start_time_s(motion, c, spec.count, run_s));
    ids_.push_back(world_.add({levels, spec.level, motion.sample(starts_s_[c])}));
  }
}

double Crowd::tick() {
  using Clock = std::chrono::steady_clock;
  ++ticks_;
  for (std::size_t c = 0; c < ids_.size(); ++c) {
    world_.set_pose(ids_[c], motion_.sample(starts_s_[c] + static_cast<double>(ticks_) / spec_.rate_hz));
  }
  const Clock::time_point begin = Clock::now();
  report_ = world_.step();
  const double seconds = std::chrono::duration<double>(Clock::now() - begin).count();
  resets_ += report_.lattices_reset;
  return seconds;
}

std::string Crowd::hash() const {
  StateHash hash;
  hash.add(world_.hash());
  return hash.text();
}

}  // namespace hairnet::bench
