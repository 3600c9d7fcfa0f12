#include "client/tools/sim/stepper.hpp"

#include <utility>

#include "core/solver/reference_step.hpp"

namespace hairnet::sim {
namespace {

// Steps like the server: the world, with one character. Its kernels are the server's.
class WorldStepper : public Stepper {
 public:
  explicit WorldStepper(const StepperDef& def)
      : world_(world_def(def)), id_(world_.add({def.levels, def.level, def.start})) {}
  StepReport step(const Pose& to, bool teleport) override {
    // The flag of a jump goes along; the world also finds jumps by itself.
    world_.set_pose(id_, to, teleport);
    return world_.step();
  }
  [[nodiscard]] const LatticeState& state() const override { return world_.state(id_); }

 private:
  static WorldDef world_def(const StepperDef& def) {
    WorldDef world;
    world.tick_s = def.tick_s;
    world.substep_count = def.substep_count;
    world.character_count_max = 1;
    world.iterations = def.iterations;
    world.environment = def.environment;
    return world;
  }
  World world_;
  CharacterId id_;
};

// The same ticks with every step's linear system solved in double (reference_step). The lattice stays in double, in
// world axes: rounding to head space and floats between ticks would hide what it is compared for. It repeats by hand
// what the World does around a step: substeps, teleports.
class ConvergedStepper : public Stepper {
 public:
  explicit ConvergedStepper(const StepperDef& def)
      : def_(def), level_((*def_.levels)[def.level]), from_(def.start), last_from_(def.start) {
    reset_to_rest(level_, state_);
    lattice_ = to_world(level_, from_.head(), state_);
  }

  StepReport step(const Pose& to, bool teleport) override {
    StepReport report;
    const Vec3 velocity_before = head_velocity_;
    // A jump must not become the velocity that the next interval is compared with.
    if (!teleport) head_velocity_ = velocity_to_expect(from_, to, def_.tick_s, velocity_before);
    if (teleport || is_teleport(from_, to, def_.tick_s, velocity_before)) {
      // Velocities become relative to the head's while it jumps: the old head's velocity means nothing at the new
      // place.
      add_rigid_velocity(last_from_.head(), from_.head(), -1);
      // The lattice keeps its shape and turns with the head.
      move_rigidly(to.head() * from_.head().inverse());
      last_from_ = to;
      // The next step adds the velocity of the new head.
      is_relative_ = true;
      report.teleports = 1;
    } else {
      step_smoothly(to);
      report.stepped = 1;
    }
    from_ = to;
    ++tick_;
    state_ = to_head(level_, to.head(), lattice_);
    return report;
  }
  [[nodiscard]] const LatticeState& state() const override { return state_; }

 private:
  void move_rigidly(const RigidTransform& jump) {
    for (Vec3& p : lattice_.P) p = jump.point(p);
    for (Vec3& v : lattice_.P_dot) v = jump.vector(v);
  }
  // `sign` times the velocity of hair that moves rigidly with the head through a substep.
  void add_rigid_velocity(const RigidTransform& from, const RigidTransform& to, double sign) {
    const double substep_s = def_.tick_s / def_.substep_count;
    for (std::size_t i = 0; i < lattice_.P_dot.size(); ++i) {
      const Vec3 rest = level_.rest[i].cast<double>();
      lattice_.P_dot[i] += sign / substep_s * (to.point(rest) - from.point(rest));
    }
  }
  [[nodiscard]] Pose after(int substep, const Pose& to) const {
    return substep == def_.substep_count ? to : interpolate(from_, to, double(substep) / def_.substep_count);
  }
  void step_smoothly(const Pose& to) {
    const double substep_s = def_.tick_s / def_.substep_count;
    // This is the first substep after a jump, which begins with the head's own velocity.
    if (std::exchange(is_relative_, false)) add_rigid_velocity(from_.head(), after(1, to).head(), 1);
    StepInput input{from_, from_, substep_s, &def_.environment, 0, {}, tick_ * def_.tick_s};
    for (int substep = 1; substep <= def_.substep_count; ++substep) {
      // Substeps interpolate between the poses of the tick.
      input.from = std::exchange(input.to, after(substep, to));
      input.time_s += substep_s;
      reference_step(level_, input, lattice_);
    }
    // The pose one substep before the end: a jump next removes the velocity of that substep.
    last_from_ = input.from;
  }

  StepperDef def_;
  // The level that is stepped; def_ keeps it alive.
  const Level& level_;
  // The poses at the end of the last tick, and one substep before that.
  Pose from_, last_from_;
  // The velocity of the head in the last tick, world, m/s.
  Vec3 head_velocity_ = Vec3::Zero();
  // Velocities are relative to the head's, after a teleport.
  bool is_relative_ = false;
  // The number of the ticks that are done; a double, since it is multiplied by their length.
  double tick_ = 0;
  // The state in world axes and double, and the same in head space and floats, for `state`.
  WorldLattice lattice_;
  LatticeState state_;
};

}  // namespace

std::unique_ptr<Stepper> make_stepper(Solver solver, const StepperDef& def) {
  if (solver == Solver::converged) return std::make_unique<ConvergedStepper>(def);
  return std::make_unique<WorldStepper>(def);
}

}  // namespace hairnet::sim
