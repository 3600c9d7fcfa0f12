#include "tests/load/run.hpp"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "schema/channel/monotonic_clock.hpp"
#include "tests/load/attack_grooms.hpp"
#include "tests/load/attack_thread.hpp"
#include "tests/load/fleet.hpp"
#include "tests/load/frame_check.hpp"
#include "tests/load/get_page.hpp"
#include "tests/load/groom_uploader.hpp"
#include "tests/load/late_joiner.hpp"
#include "tests/load/link_protocol_client.hpp"
#include "tests/load/stage_figures.hpp"

namespace hairnet::load {
namespace {

// The generator wakes up once a millisecond at most, so poses that are due within it leave together.
constexpr std::int64_t kGrid_ns = 1'000'000;
// The plan begins so long after the preparation.
constexpr std::int64_t kLeadIn_ns = 100'000'000;
// Processes are sampled, and the progress is shown, twice a second.
constexpr std::int64_t kSampleInterval_ns = 500'000'000;
// After the end the run waits so long for frames under way: a little longer than kAnswerWait_ns in client.cpp.
constexpr std::int64_t kLastAnswers_ns = 260'000'000;
// The grooms must be ready within this time. One build may take 600 s.
constexpr std::int64_t kPreparation_ns_max = 700'000'000'000;
constexpr std::int64_t kPreparationRound_ns = 20'000'000;
// Clients that have said goodbye get 50 rounds of 10 ms to close their connections.
constexpr std::int64_t kGoodbyeRound_ns = 10'000'000;
constexpr int kGoodbyeRounds = 50;
// A request for /metrics is given up after a second. At the end the run waits a little longer for those under way.
constexpr std::chrono::seconds kScrapeWait{1};
constexpr std::int64_t kScrapeRound_ns = 1'100'000'000;
constexpr std::int64_t kNewcomerAfter_ns = 2'000'000'000;  // a stage's begin: its attack has set in
// The first loopback addresses of witnesses and of late joiners (Connector::connect): 127.1.0.1 and 127.3.0.1.
constexpr std::uint32_t kFirstWitnessHost = 0x010001, kFirstLateJoinerHost = 0x030001;

void run_until(asio::io_context& io, std::int64_t time_ns) {
  io.run_until(std::chrono::steady_clock::time_point(std::chrono::nanoseconds(time_ns)));
}

// The counters at the beginning or the end of the measured part of a stage. Each stage has two marks, 2 i and 2 i + 1.
struct Mark {
  std::int64_t at_ns = 0;
  std::uint64_t checked = 0, check_failures = 0;
  std::optional<ProcessUse> own, server;
  Exposition metrics;
};

class Run {
 public:
  Run(const Plan& plan, const Assets& assets, const RunOptions& options,
      const std::function<void(const RunProgress&)>& show, asio::ip::tcp::endpoint server)
      : plan_(&plan),
        options_(&options),
        show_(&show),
        server_(std::move(server)),
        connector_(make_connector(io_, options.transport, options.server, server_)),
        check_(plan.seed, options.check_share) {
    context_.seed = plan.seed;
    context_.pose_hz = plan.pose_hz;
    context_.room_size = plan.room_size;
    context_.touch_share = plan.touch_share;
    context_.props_share = plan.props_share;
    context_.grooms = &assets.grooms;
    context_.motions = &assets.motions;
    context_.connector = connector_.get();
    context_.make_protocol_client = [this](std::uint32_t client, std::uint32_t place) {
      return make_protocol_client(client, place);
    };
    if (options.check_share > 0) context_.watcher = &check_;
    if (!plan.has_attacks()) return;
    context_.first_host = kFirstWitnessHost;
    late_joiner_figures_.resize(plan.stages.size());
    for (std::size_t i = 0; i < plan.stages.size(); ++i) late_joiner_grooms_.push_back(make_late_joiner_groom(i));
  }

  Result<RunResult> perform() {
    if (auto prepared = prepare(); !prepared) return Refusal(prepared.error());
    result_.plan = *plan_;
    result_.tick_rate_hz = preparation_->welcome().tick_rate_hz;
    begin_ns_ = channel::monotonic_ns() + kLeadIn_ns;
    end_ns_ = begin_ns_ + plan_->stage_begin_ns(plan_->stages.size());
    for (std::size_t i = 0; i < plan_->stages.size(); ++i) {
      const std::int64_t stage_ns = begin_ns_ + plan_->stage_begin_ns(i);
      marks_.push_back({stage_ns + std::llround(plan_->stages[i].warm_s * 1e9), 0, 0, {}, {}, {}});
      marks_.push_back({begin_ns_ + plan_->stage_begin_ns(i + 1), 0, 0, {}, {}, {}});
    }
    tally_.emplace(*plan_, begin_ns_);
    context_.tally = &*tally_;
    {
      std::optional<AttackThread> attacks;
      if (plan_->has_attacks()) {
        const AttackContext attack{.groom = context_.grooms->front().hash};
        attacks.emplace(*plan_, server_, attack, late_joiner_grooms_, begin_ns_);
      }
      Fleet fleet(*plan_, context_, begin_ns_);
      drive(fleet);
      if (attacks) attack_events_ = attacks->finish();
    }
    run_until(io_, channel::monotonic_ns() + (scrapes_under_way_ > 0 ? kScrapeRound_ns : 0));
    conclude();
    return std::move(result_);
  }

 private:
  std::unique_ptr<ProtocolClient> make_protocol_client(std::uint32_t client, std::uint32_t place) {
    ProtocolOptions protocol =
        peer_options("load-" + std::to_string(client), "load-" + std::to_string(context_.room_of(place)));
    protocol.seed = plan_->seed + client;
    return make_link_protocol_client(std::move(protocol));
  }
  ProtocolOptions peer_options(std::string name, std::string room) {
    return {std::move(name), std::move(room),        options_->token,
            plan_->observe,  plan_->hair_error_mm,   plan_->frame_bytes_per_s,
            plan_->seed,     options_->decode_share, options_->evaluate_learnt,
            catalog_};
  }

  Result<void> prepare() {
    preparation_ = std::make_unique<GroomUploader>(
        *connector_, make_link_protocol_client(peer_options("load-preparation", "load-preparation")), *context_.grooms);
    const std::int64_t deadline_ns = channel::monotonic_ns() + kPreparation_ns_max;
    while (!preparation_->done()) {
      if (!preparation_->error().empty()) return Refusal(preparation_->error());
      if (stopped()) return Refusal("stopped before it began");
      if (channel::monotonic_ns() > deadline_ns) return Refusal("the grooms are not ready in time");
      preparation_->poll(channel::monotonic_ns());
      run_until(io_, channel::monotonic_ns() + kPreparationRound_ns);
    }
    return {};
  }

  void drive(Fleet& fleet) {
    std::int64_t now_ns = channel::monotonic_ns();
    while (now_ns < end_ns_ && !stopped()) {
      const std::int64_t soonest_ns = std::max(fleet.next_ns(), now_ns + kGrid_ns);
      run_until(io_, std::min({soonest_ns, next_sample_ns(), next_mark_ns(), end_ns_}));
      now_ns = channel::monotonic_ns();
      pass_marks(now_ns);
      if (plan_->has_attacks()) receive_late_joiner(now_ns);
      if (now_ns < end_ns_) fleet.advance(now_ns);
      tally_->advance(now_ns);
      if (now_ns >= next_sample_ns()) {
        sample(fleet, now_ns);
        preparation_->poll(now_ns);
      }
    }
    result_.ended_early = now_ns < end_ns_;
    pass_marks(now_ns);
    dismiss_late_joiner(now_ns);
    run_until(io_, now_ns + kLastAnswers_ns);
    fleet.finish(channel::monotonic_ns());
    for (int i = 0; i < kGoodbyeRounds && !fleet.empty(); ++i) {
      run_until(io_, channel::monotonic_ns() + kGoodbyeRound_ns);
      fleet.advance(channel::monotonic_ns());
    }
    tally_->finish(now_ns);
    if (result_.ended_early) ended_ns_ = now_ns;
  }

  // Starts the late joiner of a stage that has begun. The one of the stage before leaves.
  void receive_late_joiner(std::int64_t now_ns) {
    while (next_late_joiner_ < plan_->stages.size() && begin_ns_ + plan_->stage_begin_ns(next_late_joiner_) <= now_ns) {
      dismiss_late_joiner(now_ns);
      const std::size_t stage = next_late_joiner_++;
      late_joiner_ = std::make_unique<LateJoiner>(
          io_, *connector_, server_, make_link_protocol_client(peer_options("load-late-joiner", "load-late-joiner")),
          late_joiner_grooms_[stage], kFirstLateJoinerHost + static_cast<std::uint32_t>(stage),
          begin_ns_ + plan_->stage_begin_ns(stage) + kNewcomerAfter_ns);
    }
    if (late_joiner_) late_joiner_->poll(now_ns);
  }
  // The error counts just before now, so that it belongs to the stage that ends.
  void dismiss_late_joiner(std::int64_t now_ns) {
    if (!late_joiner_) return;
    late_joiner_figures_[next_late_joiner_ - 1] = late_joiner_->figures(now_ns);
    if (!late_joiner_->error().empty()) tally_->count_error(now_ns - 1, "late joiner: " + late_joiner_->error());
    late_joiner_.reset();
  }

  [[nodiscard]] bool stopped() const { return options_->stop && *options_->stop; }
  [[nodiscard]] std::int64_t next_mark_ns() const {
    return next_mark_ < marks_.size() ? marks_[next_mark_].at_ns : kNever_ns;
  }
  [[nodiscard]] std::int64_t next_sample_ns() const { return begin_ns_ + sample_count_ * kSampleInterval_ns; }

  // Takes the marks that are due.
  void pass_marks(std::int64_t now_ns) {
    for (; next_mark_ < marks_.size() && marks_[next_mark_].at_ns <= now_ns; ++next_mark_) take_mark(next_mark_);
  }
  void take_mark(std::size_t index) {
    Mark& mark = marks_[index];
    mark.own = sample_process(getpid());
    if (options_->server_pid) mark.server = sample_process(*options_->server_pid);
    mark.checked = check_.checked();
    mark.check_failures = check_.failure_count();
    if (!options_->scrape_metrics) return;
    ++scrapes_under_way_;
    get_page(io_, server_, "/metrics", kScrapeWait, [this, index](std::string_view body) {
      --scrapes_under_way_;
      marks_[index].metrics = parse_exposition(body);
    });
  }

  void sample(const Fleet& fleet, std::int64_t now_ns) {
    sample_count_ = (now_ns - begin_ns_) / kSampleInterval_ns + 1;
    const auto own = sample_process(getpid());
    const auto server = options_->server_pid ? sample_process(*options_->server_pid) : std::nullopt;
    if (options_->server_pid && !server) result_.server_died = true;
    ProcessPoint point;
    point.at_s = static_cast<double>(now_ns - begin_ns_) * 1e-9;
    const double passed_s = static_cast<double>(now_ns - sampled_ns_) * 1e-9;
    if (own) point.generator_resident_mib = own->resident_mib;
    if (own && sampled_own_) point.generator_cpu_cores = (own->cpu_s - sampled_own_->cpu_s) / passed_s;
    if (server) point.server_resident_mib = server->resident_mib;
    if (server && plan_->has_attacks()) point.builds_resident_mib = children_resident_mib(*options_->server_pid);
    if (server && sampled_server_) point.server_cpu_cores = (server->cpu_s - sampled_server_->cpu_s) / passed_s;
    if (sampled_own_) result_.processes.push_back(point);
    sampled_own_ = own;
    sampled_server_ = server;
    sampled_ns_ = now_ns;
    if (!*show_) return;
    RunProgress progress;
    progress.time_s = point.at_s;
    progress.duration_s = plan_->duration_s();
    for (std::size_t i = 0; i < plan_->stages.size(); ++i)
      if (begin_ns_ + plan_->stage_begin_ns(i) <= now_ns) progress.stage = plan_->stages[i].name;
    progress.clients = fleet.client_count();
    progress.characters = fleet.character_count();
    progress.bad_clients = fleet.bad_client_count();
    progress.latest = tally_->latest(now_ns);
    progress.generator_cpu_cores = point.generator_cpu_cores;
    progress.server_cpu_cores = point.server_cpu_cores;
    progress.server_resident_mib = point.server_resident_mib;
    progress.check_failures = check_.failure_count();
    (*show_)(progress);
  }

  void conclude() {
    // The marks of stage i are 2 i, at the end of its warm-up, and 2 i + 1, at its end.
    LatencyHistogram lag;
    for (std::size_t i = 0; i < plan_->stages.size(); ++i) {
      const Mark &from = marks_[2 * i], &to = marks_[2 * i + 1];
      // The run ended before it reached this stage.
      if (ended_ns_ > 0 && ended_ns_ <= from.at_ns) break;
      StageResult stage;
      stage.stage = plan_->stages[i];
      stage.begin_s = static_cast<double>(from.at_ns - begin_ns_) * 1e-9;
      const std::int64_t until_ns = ended_ns_ > 0 ? std::min(ended_ns_, to.at_ns) : to.at_ns;
      stage.duration_s = static_cast<double>(until_ns - from.at_ns) * 1e-9;
      stage.tally = tally_->stage(i);
      StageInputs inputs;
      inputs.tally = &stage.tally;
      inputs.duration_s = stage.duration_s;
      if (from.own && to.own) inputs.own = stage.own = use_between(*from.own, *to.own);
      if (from.server && to.server) {
        inputs.server = stage.server = use_between(*from.server, *to.server);
        inputs.server_resident_growth_mib = to.server->resident_mib - from.server->resident_mib;
      }
      for (const ProcessPoint& point : result_.processes) {
        if (point.at_s < stage.begin_s || point.at_s > stage.begin_s + stage.duration_s) continue;
        inputs.server_resident_peak_mib = std::max(inputs.server_resident_peak_mib, point.server_resident_mib);
        inputs.builds_resident_peak_mib = std::max(inputs.builds_resident_peak_mib, point.builds_resident_mib);
      }
      if (!to.metrics.empty()) stage.server_metrics = exposition_between(from.metrics, to.metrics);
      inputs.server_metrics = &stage.server_metrics;
      inputs.pose_delay_ms = static_cast<double>(preparation_->welcome().pose_delay_ns) * 1e-6;
      inputs.frames_checked = to.checked - std::min(to.checked, from.checked);
      inputs.check_failures = to.check_failures - std::min(to.check_failures, from.check_failures);
      stage.figures = make_figures(inputs);
      if (plan_->has_attacks()) add_attack(i, stage);
      if (stage.stage.measured) lag.merge(stage.tally.lag);
      result_.stages.push_back(std::move(stage));
    }
    for (std::size_t i = 1; i + 1 < result_.stages.size(); ++i)
      if (result_.stages[i].stage.attack)
        compare_with_calm(result_.stages[i].figures, result_.stages[i - 1].figures, result_.stages[i + 1].figures);
    result_.generator_lag_p99_ms = lag.quantile_ms(0.99);
    result_.windows = tally_->windows();
    result_.check_failures = check_.failures();
  }

  void add_attack(std::size_t index, StageResult& stage) {
    stage.figures.merge(late_joiner_figures_[index]);
    for (const auto& [event, count] : attack_events_[index])
      stage.tally.counts.bad_client_ends["attack: " + event] = count;
  }

  const Plan* plan_;
  const RunOptions* options_;
  const std::function<void(const RunProgress&)>* show_;
  asio::io_context io_;
  asio::executor_work_guard<asio::io_context::executor_type> work_ = asio::make_work_guard(io_);
  asio::ip::tcp::endpoint server_;
  std::unique_ptr<Connector> connector_;
  FrameCheck check_;
  std::shared_ptr<link::FileCatalog> catalog_ = std::make_shared<link::FileCatalog>();
  ClientContext context_;
  std::unique_ptr<GroomUploader> preparation_;
  std::optional<Tally> tally_;
  RunResult result_;
  // The begin and the planned end of the plan. `ended_ns_` is the time of an early end, else 0.
  std::int64_t begin_ns_ = 0, end_ns_ = 0, ended_ns_ = 0;
  std::vector<Mark> marks_;
  std::size_t next_mark_ = 0;
  std::size_t scrapes_under_way_ = 0;
  // These three lists are by stage, and empty in a plan without attacks.
  std::vector<EncodedGroom> late_joiner_grooms_;
  std::vector<Figures> late_joiner_figures_;
  std::vector<std::map<std::string, std::uint64_t, std::less<>>> attack_events_;
  std::unique_ptr<LateJoiner> late_joiner_;
  // The stage of the late joiner that comes next.
  std::size_t next_late_joiner_ = 0;
  std::int64_t sample_count_ = 0, sampled_ns_ = 0;
  std::optional<ProcessUse> sampled_own_, sampled_server_;
};

}  // namespace

Result<RunResult> run_plan(const Plan& plan, const Assets& assets, const RunOptions& options,
                           const std::function<void(const RunProgress&)>& show) {
  auto server = resolve(options.server);
  if (!server) return Refusal(server.error());
  return Run(plan, assets, options, show, *server).perform();
}

}  // namespace hairnet::load
