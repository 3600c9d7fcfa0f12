#include "tests/bench/step_runner.hpp"

#include <algorithm>

#include "core/solver/crowd_step.hpp"
#include "tests/bench/plain_model.hpp"
#include "tests/bench/state_hash.hpp"

namespace hairnet::bench {
namespace {

// A character's inputs, step by step.
std::vector<StepInput> inputs_of(const Workload& cast, const BenchCharacter& character, int steps_per_frame) {
  std::vector<StepInput> inputs;
  for (std::size_t frame = 0; frame < cast.frame_count; ++frame) {
    for (int s = 0; s < steps_per_frame; ++s) inputs.push_back(step_input(cast, character, frame, s, steps_per_frame));
  }
  return inputs;
}

// Runs a baseline, which works on lattices in the world in plain doubles.
class BaselineRunner final : public StepRunner {
 public:
  BaselineRunner(Baseline kind, const Level& level, const Workload& cast, const StepRunnerSettings& settings)
      : level_(level), workload_(cast), model_(level, cast.frame_s / settings.steps_per_frame) {
    const BaselineSettings solver{settings.iterations, settings.relative_residual};
    baseline_ =
        kind == Baseline::naive ? make_naive_step(model_.level(), solver) : make_fair_step(model_.level(), solver);
    for (const BenchCharacter& character : cast.characters) {
      auto& steps = steps_.emplace_back();
      for (const StepInput& input : inputs_of(cast, character, settings.steps_per_frame))
        steps.emplace_back(level, input);
    }
    lattices_.resize(cast.characters.size());
  }

  void rewind() override {
    for (std::size_t c = 0; c < lattices_.size(); ++c) {
      const BenchCharacter& character = workload_.characters[c];
      lattices_[c] = to_world(level_, character.poses.front().head(), character.state);
    }
  }
  bool perform() override {
    bool is_finite = true;
    for (std::size_t c = 0; c < lattices_.size(); ++c) {
      for (const PlainStep& input : steps_[c]) is_finite &= step(*baseline_, input, lattices_[c]);
    }
    return is_finite;
  }
  [[nodiscard]] std::vector<LatticeState> states() const override {
    std::vector<LatticeState> states;
    for (std::size_t c = 0; c < lattices_.size(); ++c) {
      states.push_back(to_head(level_, workload_.characters[c].poses.back().head(), lattices_[c]));
    }
    return states;
  }
  [[nodiscard]] std::string hash() const override {
    StateHash hash;
    for (const WorldLattice& lattice : lattices_) hash.add(lattice);
    return hash.text();
  }

 private:
  const Level& level_;
  const Workload& workload_;
  PlainModel model_;
  std::unique_ptr<BaselineStep> baseline_;
  std::vector<std::vector<PlainStep>> steps_;
  std::vector<WorldLattice> lattices_;
};

// What both of our kernels have: the inputs of all steps, made before the time is measured, and a state for each
// character.
class KernelRunner : public StepRunner {
 public:
  KernelRunner(const Level& level, const Workload& cast, const StepRunnerSettings& settings)
      : level_(level), workload_(cast), solver_{.iterations = settings.iterations} {
    for (const BenchCharacter& character : cast.characters)
      inputs_.push_back(inputs_of(cast, character, settings.steps_per_frame));
    states_.resize(cast.characters.size());
  }

  void rewind() override {
    for (std::size_t c = 0; c < states_.size(); ++c) states_[c] = workload_.characters[c].state;
  }
  [[nodiscard]] std::vector<LatticeState> states() const override { return states_; }
  [[nodiscard]] std::string hash() const override {
    StateHash hash;
    for (const LatticeState& state : states_) hash.add(state);
    return hash.text();
  }

 protected:
  const Level& level_;
  const Workload& workload_;
  SolverSettings solver_;
  std::vector<std::vector<StepInput>> inputs_;
  std::vector<LatticeState> states_;
};

// Steps one character at a time, through all its frames.
class SingleRunner final : public KernelRunner {
 public:
  using KernelRunner::KernelRunner;
  bool perform() override {
    bool is_finite = true;
    for (std::size_t c = 0; c < states_.size(); ++c) {
      for (const StepInput& input : inputs_[c]) is_finite &= step(level_, input, solver_, scratch_, states_[c]);
    }
    return is_finite;
  }

 private:
  StepScratch scratch_;
};

// Steps as many characters side by side as the vector width allows (crowd_width).
class CrowdRunner final : public KernelRunner {
 public:
  CrowdRunner(const Level& level, const Workload& cast, const StepRunnerSettings& settings)
      : KernelRunner(level, cast, settings), members_(crowd_width()) {}

  bool perform() override {
    bool is_finite = true;
    for (std::size_t begin = 0; begin < states_.size(); begin += members_.size()) {
      const std::size_t count = std::min(members_.size(), states_.size() - begin);
      for (std::size_t frame = 0; frame < workload_.frame_count; ++frame) {
        is_finite &= perform_frame(begin, count, frame);
      }
    }
    return is_finite;
  }

 private:
  // As a world does: the steps of one frame at a time.
  bool perform_frame(std::size_t begin, std::size_t count, std::size_t frame) {
    for (std::size_t m = 0; m < count; ++m) {
      const std::size_t steps = inputs_[begin + m].size() / workload_.frame_count;
      members_[m] = {std::span(inputs_[begin + m]).subspan(frame * steps, steps), &states_[begin + m]};
    }
    step_crowd(level_, std::span(members_).first(count), solver_, scratch_);
    return std::ranges::all_of(std::span(members_).first(count), &CrowdMember::is_finite);
  }

  std::vector<CrowdMember> members_;
  StepScratch scratch_;
};

}  // namespace

std::unique_ptr<StepRunner> make_baseline(Baseline kind, const Level& level, const Workload& cast,
                                          const StepRunnerSettings& settings) {
  return std::make_unique<BaselineRunner>(kind, level, cast, settings);
}
std::unique_ptr<StepRunner> make_single(const Level& level, const Workload& cast, const StepRunnerSettings& settings) {
  return std::make_unique<SingleRunner>(level, cast, settings);
}
std::unique_ptr<StepRunner> make_crowd(const Level& level, const Workload& cast, const StepRunnerSettings& settings) {
  return std::make_unique<CrowdRunner>(level, cast, settings);
}

}  // namespace hairnet::bench
