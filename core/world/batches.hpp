#pragma once

#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "core/parallel_for.hpp"
#include "core/solver/crowd_step.hpp"
#include "core/world/character.hpp"

namespace hairnet {

// Those characters that are to be stepped in one tick, packed into batches of one level. Buffers stay from tick to
// tick.
class Batches {
 public:
  void clear();
  // Characters of one level one after the other, so that they share batches.
  void add(Character& character, Outcome& outcome);

  // Steps all and ends their tick. `iterations`: of conjugate gradient; 0: iterations_for.
  void step(const TickTerms& terms, int iterations, const ParallelFor& parallel_for);

 private:
  struct Item {
    Character* character;
    Outcome* outcome;
  };
  struct Batch {
    const Level* level;
    std::size_t begin, end;  // items
  };
  // What one batch at a time works with.
  struct Scratch {
    StepScratch step;
    std::vector<StepInput> inputs;  // of a member after the other
    std::vector<CrowdMember> members;
  };

  void step(const TickTerms& terms, int iterations, const Batch& batch);
  void step_members(const Level& level, int iterations, Scratch& scratch) const;
  std::unique_ptr<Scratch> take_scratch();
  void put_scratch(std::unique_ptr<Scratch> scratch);

  std::size_t width_ = crowd_width();
  std::vector<Item> items_;
  std::vector<Batch> batches_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<Scratch>> scratches_;  // last used, first taken: it is still in the cache
};

}  // namespace hairnet
