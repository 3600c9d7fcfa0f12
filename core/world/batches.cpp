#include "core/world/batches.hpp"

#include <functional>
#include <utility>

namespace hairnet {

void Batches::clear() {
  items_.clear();
  batches_.clear();
}

void Batches::add(Character& character, Outcome& outcome) {
  const Level* level = character.model();
  const std::size_t index = items_.size();
  items_.push_back({&character, &outcome});
  if (batches_.empty() || batches_.back().level != level || index - batches_.back().begin == width_) {
    batches_.push_back({level, index, index});
  }
  batches_.back().end = index + 1;
}

void Batches::step(const TickTerms& terms, int iterations, const ParallelFor& parallel_for) {
  const auto step_one = [&](std::size_t b) { step(terms, iterations, batches_[b]); };
  run(parallel_for, batches_.size(), std::cref(step_one));  // a reference, since a std::function of it would allocate
}

void Batches::step(const TickTerms& terms, int iterations, const Batch& batch) {
  std::unique_ptr<Scratch> scratch = take_scratch();
  const std::size_t count = batch.end - batch.begin;
  const auto substep_count = static_cast<std::size_t>(terms.substep_count);
  scratch->inputs.resize(width_ * substep_count);
  scratch->members.resize(count);
  const auto inputs_of = [&](std::size_t member) {
    return std::span(scratch->inputs).subspan(member * substep_count, substep_count);
  };
  for (std::size_t i = 0; i < count; ++i) {
    Character& character = *items_[batch.begin + i].character;
    put_inputs(terms, character, inputs_of(i));
    scratch->members[i] = {inputs_of(i), &character.state};
  }
  const int own = iterations_for(items_[batch.begin].character->level, terms.substep_s());
  step_members(*batch.level, iterations > 0 ? iterations : own, *scratch);
  for (std::size_t i = 0; i < count; ++i) {
    const Item& item = items_[batch.begin + i];
    *item.outcome = end_tick(terms, inputs_of(i), scratch->members[i].is_finite, *item.character);
  }
  put_scratch(std::move(scratch));
}

void Batches::step_members(const Level& level, int iterations, Scratch& scratch) const {
  const SolverSettings settings{.iterations = iterations};
  if (scratch.members.size() >= crowd_least()) return step_crowd(level, scratch.members, settings, scratch.step);
  for (CrowdMember& member : scratch.members) {
    for (const StepInput& input : member.inputs) {
      member.is_finite = hairnet::step(level, input, settings, scratch.step, *member.state) && member.is_finite;
    }
  }
}

std::unique_ptr<Batches::Scratch> Batches::take_scratch() {
  const std::lock_guard lock(mutex_);
  if (scratches_.empty()) return std::make_unique<Scratch>();
  std::unique_ptr<Scratch> scratch = std::move(scratches_.back());
  scratches_.pop_back();
  return scratch;
}

void Batches::put_scratch(std::unique_ptr<Scratch> scratch) {
  const std::lock_guard lock(mutex_);
  scratches_.push_back(std::move(scratch));
}

}  // namespace hairnet
