#include "tests/load/attack_thread.hpp"

#include <pthread.h>
#include <sys/resource.h>

#include <chrono>
#include <utility>

#include "schema/channel/monotonic_clock.hpp"
#include "tests/load/attacks.hpp"

namespace hairnet::load {
namespace {

constexpr std::chrono::milliseconds kAttackRound{4}, kAttackWait{50};
constexpr int kLowestPriority = 19;

}  // namespace

AttackThread::AttackThread(const Plan& plan, const asio::ip::tcp::endpoint& server, const AttackContext& context,
                           std::vector<EncodedGroom> late_joiner_grooms, std::int64_t begin_ns)
    : plan_(&plan),
      server_(server),
      context_(context),
      late_joiner_grooms_(std::move(late_joiner_grooms)),
      begin_ns_(begin_ns),
      events_(plan.stages.size()),
      thread_([this](const std::stop_token& stop) { run(stop); }) {}

std::vector<std::map<std::string, std::uint64_t, std::less<>>> AttackThread::finish() {
  thread_.request_stop();
  thread_.join();
  return std::move(events_);
}

void AttackThread::run(const std::stop_token& stop) {
  pthread_setname_np(pthread_self(), "attack");
  // On Linux this call sets the priority of this thread alone.
  setpriority(PRIO_PROCESS, 0, kLowestPriority);
  for (std::size_t stage = 0; stage < plan_->stages.size(); ++stage) {
    if (!plan_->stages[stage].attack) continue;
    while (channel::monotonic_ns() < begin_ns_ + plan_->stage_begin_ns(stage) && !stop.stop_requested())
      std::this_thread::sleep_for(kAttackWait);
    attack(stage, stop);
  }
}

void AttackThread::attack(std::size_t stage, const std::stop_token& stop) {
  asio::io_context io;
  const auto work = asio::make_work_guard(io);
  TcpConnector connector(io, server_);
  AttackContext context = context_;
  context.connector = &connector;
  context.events = &events_[stage];
  context.late_joiner_groom = late_joiner_grooms_[stage].hash;
  context.late_joiner_groom_bytes = late_joiner_grooms_[stage].bytes->size();
  const auto attackers = make_attackers(*plan_->stages[stage].attack, context);
  const std::int64_t end_ns = begin_ns_ + plan_->stage_begin_ns(stage + 1);
  while (channel::monotonic_ns() < end_ns && !stop.stop_requested()) {
    for (const auto& attacker : attackers) attacker->act(channel::monotonic_ns());
    io.run_for(kAttackRound);
  }
}

}  // namespace hairnet::load
