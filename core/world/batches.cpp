#include "core/world/batches.hpp"

#include <algorithm>
#include <functional>
#include <utility>

#include "core/assert.hpp"

namespace hairnet {
namespace {

// Characters share a batch if they share what steps them: the network, or the lattice's level.
const void* model_of(const Character& character) {
  if (character.network()) return character.network();
  return character.model();
}

}  // namespace

void Batches::clear() {
  items_.clear();
  batches_.clear();
}

void Batches::add(Character& character, Outcome& outcome) {
  const void* model = model_of(character);
  HAIRNET_ASSERT(model);
  HAIRNET_ASSERT(outcome == Outcome::stepped);
  const int ticks = character.step_ticks;
  const std::size_t index = items_.size();
  items_.push_back({&character, &outcome});
  // Only the last batch may still grow. Therefore characters that can share a batch must be added one after the other.
  const bool fits = !batches_.empty() && batches_.back().model == model && batches_.back().ticks == ticks &&
                    index - batches_.back().begin < (character.network() ? kLearntWidth : width_);
  if (!fits) batches_.push_back({model, character.level, ticks, index, index, 0});
  batches_.back().end = index + 1;
}

// A batch is the unit of work of a thread. Batches share nothing but the immutable level, so any thread may take any of
// them.
void Batches::step(const TickContext& terms, ClockNs now_ns, const ParallelFor& parallel_for) {
  const auto step_one = [&](std::size_t b) {
    const std::int64_t begin_ns = now_ns ? now_ns() : 0;
    step(terms, batches_[b]);
    if (now_ns) batches_[b].step_ns = now_ns() - begin_ns;
  };
  run_loop(parallel_for, batches_.size(),
           // The loop gets a reference, because a copy into std::function would allocate.
           std::cref(step_one));
}

StepCosts Batches::costs() const {
  StepCosts costs;
  std::size_t counted = 0;
  for (const Batch& batch : batches_) {
    StepCost& cost = costs.of(batch.level, batch.ticks);
    cost.step_ns += batch.step_ns;
    cost.character_steps += static_cast<std::uint32_t>(batch.end - batch.begin);
    counted += batch.end - batch.begin;
  }
  HAIRNET_ASSERT(counted == items_.size());
  return costs;
}

void Batches::step(const TickContext& terms, const Batch& batch) {
  HAIRNET_ASSERT(terms.plans);
  HAIRNET_ASSERT(batch.begin < batch.end);
  HAIRNET_ASSERT(batch.end <= items_.size());
  std::unique_ptr<Scratch> scratch = take_scratch();
  if (batch.level == LevelIndex::learnt) {
    scratch->characters.clear();
    for (std::size_t i = batch.begin; i < batch.end; ++i) scratch->characters.push_back(items_[i].character);
    step_learnt_turns(terms, scratch->characters);
  } else {
    step_lattices(terms, batch, *scratch);
  }
  put_scratch(std::move(scratch));
}

void Batches::step_lattices(const TickContext& terms, const Batch& batch, Scratch& scratch) {
  const std::size_t count = batch.end - batch.begin;
  const StepPlan& plan = terms.plans->of(batch.level, batch.ticks);
  const auto substep_count = static_cast<std::size_t>(plan.substep_count);
  // The buffer never shrinks, so batches of another size or another number of substeps allocate nothing.
  scratch.inputs.resize(std::max(scratch.inputs.size(), width_ * substep_count));
  scratch.members.resize(count);
  const auto inputs_of = [&](std::size_t member) {
    return std::span(scratch.inputs).subspan(member * substep_count, substep_count);
  };
  for (std::size_t i = 0; i < count; ++i) {
    Character& character = *items_[batch.begin + i].character;
    HAIRNET_ASSERT(character.model() == batch.model);
    HAIRNET_ASSERT(character.step_ticks == batch.ticks);
    put_inputs(terms, character, inputs_of(i));
    if (character.touch) put_touch(character, inputs_of(i));
    scratch.members[i] = {inputs_of(i), &character.state};
  }
  step_members(*items_[batch.begin].character->model(), plan.iterations, scratch);
  for (std::size_t i = 0; i < count; ++i) {
    const Item& item = items_[batch.begin + i];
    *item.outcome = end_tick(terms, inputs_of(i), scratch.members[i].is_finite, *item.character);
  }
}

void Batches::step_members(const Level& level, int iterations, Scratch& scratch) const {
  const SolverSettings settings{.iterations = iterations};
  // Both ways give the same bits, so only the time decides. The number of characters in a batch changes from tick to
  // tick.
  if (scratch.members.size() >= crowd_count_min()) return step_crowd(level, scratch.members, settings, scratch.step);
  for (CrowdMember& member : scratch.members) {
    for (const StepInput& input : member.inputs) {
      member.is_finite = hairnet::step(level, input, settings, scratch.step, *member.state) && member.is_finite;
    }
  }
}

std::unique_ptr<Batches::Scratch> Batches::take_scratch() {
  const MutexLock lock(mutex_);
  // There come to be as many scratches as batches were ever stepped at the same time.
  if (scratches_.empty()) return std::make_unique<Scratch>();
  std::unique_ptr<Scratch> scratch = std::move(scratches_.back());
  scratches_.pop_back();
  return scratch;
}

void Batches::put_scratch(std::unique_ptr<Scratch> scratch) {
  HAIRNET_ASSERT(scratch);
  const MutexLock lock(mutex_);
  scratches_.push_back(std::move(scratch));
}

}  // namespace hairnet
