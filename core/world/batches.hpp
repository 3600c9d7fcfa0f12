#pragma once

#include <memory>
#include <span>
#include <vector>

#include "core/mutex.hpp"
#include "core/parallel_for.hpp"
#include "core/solver/crowd_step.hpp"
#include "core/world/character.hpp"
#include "core/world/step_cost.hpp"

namespace hairnet {

// The characters to be stepped in one tick, packed into batches. All of a batch have the same level and step over the
// same number of ticks. The buffers are reused in every tick. A World calls it on its own thread; `step` spreads the
// batches over the threads of `parallel_for`.
class Batches {
 public:
  void clear();
  // Adds a character that begin_tick has told to step; asserts that it has a lattice or a network. Add characters of
  // one level and one stride one after the other, so that they share batches.
  void add(Character& character, Outcome& outcome);

  // Steps all characters and ends their tick. `now_ns` may be null: then nothing is timed.
  void step(const TickContext& terms, ClockNs now_ns, const ParallelFor& parallel_for);
  // Returns the costs of the last step.
  [[nodiscard]] StepCosts costs() const;

 private:
  // A character to be stepped, and where its outcome goes. The caller owns both, and they must not move before step()
  // has returned.
  struct Item {
    Character* character;
    Outcome* outcome;
  };
  struct Batch {
    // The lattice's Level or the LearntHair that steps all of the batch. It serves as a key alone.
    const void* model;
    LevelIndex level;
    int ticks;
    // The batch has items_[begin] up to items_[end], exclusive.
    std::size_t begin, end;
    std::int64_t step_ns;
  };
  // The working memory of one batch at a time.
  struct Scratch {
    StepScratch step;
    // The substeps of the first member, then those of the second, and so on.
    std::vector<StepInput> inputs;
    std::vector<CrowdMember> members;
    std::vector<Character*> characters;
  };

  void step(const TickContext& terms, const Batch& batch);
  void step_lattices(const TickContext& terms, const Batch& batch, Scratch& scratch);
  void step_members(const Level& level, int iterations, Scratch& scratch) const;
  std::unique_ptr<Scratch> take_scratch();
  void put_scratch(std::unique_ptr<Scratch> scratch);

  // The most members of a batch of lattices: the lanes of the machine's widest registers.
  std::size_t width_ = crowd_width();
  // All characters of the tick in the order of add(); each batch is a run of them.
  std::vector<Item> items_;
  std::vector<Batch> batches_;
  // Protects scratches_; each thread takes one Scratch for a batch and puts it back.
  Mutex mutex_;
  // The scratch that was used last is taken first, as its memory is still in the cache.
  std::vector<std::unique_ptr<Scratch>> scratches_;
};

}  // namespace hairnet
