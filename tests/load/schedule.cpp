#include "tests/load/schedule.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/random.hpp"

namespace hairnet::load {
namespace {

// The clients that a stage adds or removes come or go within the first second of it, in a spike within 20 ms, and in a
// ramp over the whole stage.
constexpr double kSteadySpread_s = 1;
constexpr double kSpikeSpread_s = 0.02;
// The stream of random numbers, so that the schedule shares none with the clients, whose streams are their numbers. The
// hexadecimal number reads like "sched".
constexpr std::uint64_t kStream = 0x5c4ed;

std::int64_t ns(double seconds) {
  return std::llround(seconds * 1e9);
}

class ScheduleBuilder {
 public:
  explicit ScheduleBuilder(const Plan& plan) : plan_(&plan), random_(plan.seed, kStream) {}

  std::vector<Action> write() {
    for (std::size_t s = 0; s < plan_->stages.size(); ++s) write_stage(s);
    std::ranges::stable_sort(actions_, {}, &Action::at_ns);
    return std::move(actions_);
  }

 private:
  void write_stage(std::size_t index) {
    const Stage& stage = plan_->stages[index];
    stage_ = index;
    begin_ns_ = plan_->stage_begin_ns(index);
    if (stage.characters != characters_) {
      for (const std::uint32_t client : people_)
        actions_.push_back({begin_ns_, Action::Kind::set_characters, client, 0, {}, stage.characters, index});
    }
    characters_ = stage.characters;
    const double spread_s = stage.kind == StageKind::ramp    ? stage.duration_s
                            : stage.kind == StageKind::spike ? kSpikeSpread_s
                                                             : std::min(kSteadySpread_s, stage.duration_s / 4);
    go_to(people_, stage.clients, spread_s, std::nullopt);
    for (std::size_t kind = 0; kind < kMisbehaviourCount; ++kind)
      go_to(bad_clients_[kind], stage.misbehaving[kind].of(stage.clients), std::min(spread_s, kSteadySpread_s),
            static_cast<Misbehaviour>(kind));
    churn(stage, spread_s);
    storm(stage);
  }

  // Makes the group have `count` clients, with arrivals or departures evenly over `spread_s`. The client that came last
  // leaves first.
  void go_to(std::vector<std::uint32_t>& group, std::uint32_t count, double spread_s,
             std::optional<Misbehaviour> misbehaviour) {
    const std::size_t from = group.size();
    const double steps = std::abs(static_cast<double>(count) - static_cast<double>(from));
    const auto at = [&](std::size_t i) { return begin_ns_ + ns(spread_s * (static_cast<double>(i) + 0.5) / steps); };
    for (std::size_t i = 0; from + i < count; ++i)
      group.push_back(join(at(i), static_cast<std::uint32_t>(group.size()), misbehaviour));
    for (std::size_t i = 0; group.size() > count; ++i) {
      leave(at(i), group.back());
      group.pop_back();
    }
  }

  // Replaces single clients at random times (a Poisson process) once all clients of the stage have arrived. A ramp,
  // whose clients arrive until its end, has no churn.
  void churn(const Stage& stage, double from_s) {
    if (stage.churn_hz <= 0 || people_.empty()) return;
    for (double t = from_s + wait_s(stage.churn_hz); t < stage.duration_s; t += wait_s(stage.churn_hz)) {
      const auto place = static_cast<std::uint32_t>(random_.next() % people_.size());
      leave(begin_ns_ + ns(t), people_[place]);
      people_[place] = join(begin_ns_ + ns(t), place, std::nullopt);
    }
  }

  // Breaks the connections of a random share of the clients at once, in the middle of the stage.
  void storm(const Stage& stage) {
    std::vector<std::uint32_t> order = people_;
    for (std::size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[random_.next() % i]);
    order.resize(static_cast<std::size_t>(std::lround(stage.storm_share * static_cast<double>(order.size()))));
    const std::int64_t at_ns = begin_ns_ + ns(stage.duration_s / 2);
    for (const std::uint32_t client : order)
      actions_.push_back({at_ns, Action::Kind::lose_connection, client, 0, {}, 0, stage_});
  }

  std::uint32_t join(std::int64_t at_ns, std::uint32_t place, std::optional<Misbehaviour> misbehaviour) {
    actions_.push_back({at_ns, Action::Kind::join, next_client_, place, misbehaviour, characters_, stage_});
    return next_client_++;
  }
  // Lets a client leave. One in two clients sends no goodbye.
  void leave(std::int64_t at_ns, std::uint32_t client) {
    const bool politely = random_.unit() < 0.5;
    actions_.push_back({at_ns, politely ? Action::Kind::leave : Action::Kind::vanish, client, 0, {}, 0, stage_});
  }
  double wait_s(double rate_hz) { return -std::log(1 - random_.unit()) / rate_hz; }

  const Plan* plan_;
  Random random_;
  std::vector<Action> actions_;
  std::vector<std::uint32_t> people_;
  std::array<std::vector<std::uint32_t>, kMisbehaviourCount> bad_clients_;
  std::uint32_t next_client_ = 0, characters_ = 0;
  std::size_t stage_ = 0;
  std::int64_t begin_ns_ = 0;
};

}  // namespace

std::vector<Action> make_schedule(const Plan& plan) {
  return ScheduleBuilder(plan).write();
}

}  // namespace hairnet::load
