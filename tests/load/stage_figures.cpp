#include "tests/load/stage_figures.hpp"

#include <array>
#include <string>
#include <utility>

namespace hairnet::load {
namespace {

// Each distribution of times has these quantiles as figures, such as latency_p99_ms; p999 is that of 99.9 %.
struct Quantile {
  std::string_view name;
  double share;
};
constexpr std::array<Quantile, 4> kQuantiles{{{"p50", 0.5}, {"p90", 0.9}, {"p99", 0.99}, {"p999", 0.999}}};

// A stage without a value has no such figure, so a threshold on it fails instead of passing by a zero.
void put_times(Figures& figures, const std::string& name, const LatencyHistogram& times) {
  if (times.count() == 0) return;
  for (const Quantile& q : kQuantiles) figures[name + "_" + std::string(q.name) + "_ms"] = times.quantile_ms(q.share);
  figures[name + "_max_ms"] = times.max_ms();
  figures[name + "_mean_ms"] = times.mean_ms();
}

// Sets part / whole, or nothing where there is no whole.
void put_share(Figures& figures, const std::string& name, double part, double whole) {
  if (whole > 0) figures[name] = part / whole;
}

// `own` counts the frames of a client's own characters, `all` also those of others.
void put_frames(Figures& figures, const Counts& counts) {
  const double own = static_cast<double>(counts.frames), missed = static_cast<double>(counts.frames_missed);
  const double all = own + static_cast<double>(counts.frames_of_others);
  figures["frames"] = own;
  figures["frames_of_others"] = static_cast<double>(counts.frames_of_others);
  figures["frames_missed"] = missed;
  if (own > 0) figures["gap_ticks_max"] = static_cast<double>(counts.gap_ticks_max);
  put_share(figures, "frames_missed_share", missed, own + missed);
  put_share(figures, "frames_discontinuous_share", static_cast<double>(counts.frames_discontinuous), all);
  for (std::size_t i = 0; i < kLevelCount; ++i)
    put_share(figures, "level_" + std::string(kLevelNames[i]) + "_share",
              static_cast<double>(counts.frames_by_level[i]), all);
  for (std::size_t i = 0; i < kStrides.size(); ++i)
    put_share(figures, "stride_" + std::to_string(kStrides[i]) + "_share",
              static_cast<double>(counts.frames_by_stride[i]), all);
  put_share(figures, "content_bytes_per_frame", static_cast<double>(counts.content_bytes), all);
  put_share(figures, "bytes_in_per_frame", static_cast<double>(counts.bytes_in), all);
}

void put_poses(Figures& figures, const Counts& counts) {
  const auto intended = static_cast<double>(counts.poses_intended);
  figures["poses_intended"] = intended;
  figures["poses_unsent"] = static_cast<double>(counts.poses_unsent);
  figures["poses_unanswered"] = static_cast<double>(counts.poses_unanswered);
  put_share(figures, "poses_unsent_share", static_cast<double>(counts.poses_unsent), intended);
  put_share(figures, "poses_unanswered_share", static_cast<double>(counts.poses_unanswered), intended);
  put_share(figures, "poses_asleep_share", static_cast<double>(counts.poses_asleep), intended);
}

// The server's own counters, and what the system says of its process. Only a run with --spawn or --server-pid knows the
// process.
void put_server(Figures& figures, const StageInputs& inputs) {
  if (inputs.server_metrics) {
    for (const char* name : {"ticks_late", "ticks_overrun", "ticks_skipped"}) {
      const auto found = inputs.server_metrics->find("hairnet_" + std::string(name) + "_total");
      if (found != inputs.server_metrics->end()) figures["server_" + std::string(name)] = found->second;
    }
  }
  if (!inputs.server) return;
  put_share(figures, "server_cpu_cores", inputs.server->cpu_s, inputs.duration_s);
  put_share(figures, "server_cpu_us_per_character_s", inputs.server->cpu_s * 1e6, inputs.tally->counts.character_s);
  figures["server_resident_mib"] = inputs.server->resident_mib;
  figures["server_resident_growth_mib"] = inputs.server_resident_growth_mib;
  figures["server_resident_peak_mib"] = inputs.server_resident_peak_mib;
  figures["builds_resident_peak_mib"] = inputs.builds_resident_peak_mib;
}

}  // namespace

void compare_with_calm(Figures& stage, const Figures& before, const Figures& after) {
  // `before` and `after` are the stages without an attack around `stage`. A difference needs the figure in both.
  const auto put_difference = [&](const std::string& name, const Figures& of, const std::string& figure) {
    const auto value = of.find(figure), calm = before.find(figure);
    if (value != of.end() && calm != before.end()) stage[name] = value->second - calm->second;
  };
  for (const std::string figure : {"frames_missed_share", "latency_p99_ms", "level_high_share"})
    put_difference(figure + "_over_calm", stage, figure);
  put_difference("server_resident_after_mib_over_calm", after, "server_resident_mib");
}

Figures make_figures(const StageInputs& inputs) {
  const StageTally& tally = *inputs.tally;
  const Counts& counts = tally.counts;
  Figures figures;
  put_times(figures, "latency", tally.latency);
  put_times(figures, "frame_age", tally.frame_age);
  put_times(figures, "jitter", tally.jitter);
  put_times(figures, "join", tally.join);
  put_times(figures, "generator_lag", tally.lag);
  put_times(figures, "others_age", tally.others_age);
  put_times(figures, "others_interval", tally.others_interval);
  put_times(figures, "hands_latency", tally.hands_latency);
  put_times(figures, "props_latency", tally.props_latency);
  if (counts.hands_sent > 0) {
    figures["hands_sent"] = static_cast<double>(counts.hands_sent);
    figures["props_sent"] = static_cast<double>(counts.props_sent);
    figures["holds"] = static_cast<double>(counts.holds);
    figures["holds_empty"] = static_cast<double>(counts.holds_empty);
    put_share(figures, "points_per_hold", static_cast<double>(counts.held_points), static_cast<double>(counts.holds));
  }
  figures["pose_delay_ms"] = inputs.pose_delay_ms;
  figures["frames_undecodable"] = static_cast<double>(counts.frames_undecodable);
  figures["resumes"] = static_cast<double>(counts.resumes);
  figures["restarts"] = static_cast<double>(counts.restarts);
  put_frames(figures, counts);
  put_poses(figures, counts);
  figures["joins"] = static_cast<double>(counts.joins);
  figures["joins_unanswered"] = static_cast<double>(counts.joins_unanswered);
  double errors = 0;
  for (const auto& [reason, count] : counts.errors) {
    figures["error." + reason] = static_cast<double>(count);
    errors += static_cast<double>(count);
  }
  figures["errors"] = errors;
  if (inputs.duration_s > 0) {
    figures["clients"] = counts.client_s / inputs.duration_s;
    figures["characters"] = counts.character_s / inputs.duration_s;
  }
  put_share(figures, "bytes_in_per_character_s", static_cast<double>(counts.bytes_in), counts.character_s);
  put_share(figures, "bytes_out_per_character_s", static_cast<double>(counts.bytes_out), counts.character_s);
  put_share(figures, "content_bytes_per_character_s", static_cast<double>(counts.content_bytes), counts.character_s);
  put_share(figures, "frames_per_character_s", static_cast<double>(counts.frames), counts.character_s);
  if (inputs.own) {
    put_share(figures, "generator_cpu_cores", inputs.own->cpu_s, inputs.duration_s);
    put_share(figures, "generator_cpu_us_per_character_s", inputs.own->cpu_s * 1e6, counts.character_s);
  }
  put_server(figures, inputs);
  if (inputs.frames_checked > 0) {
    figures["frames_checked"] = static_cast<double>(inputs.frames_checked);
    figures["check_failures"] = static_cast<double>(inputs.check_failures);
  }
  return figures;
}

// What --list prints, and the page explains. An entry stands for the whole family of figures that its text names.
const std::vector<FigureName>& figure_names() {
  static const std::vector<FigureName> names{
      {"latency_p50_ms",
       "pose's intended capture to the arrival of the first frame sampled at or after it; also p90, "
       "p99, p999, max, mean, here and below"},
      {"frame_age_p50_ms", "from the sampling of a frame's poses to its arrival: the pose delay, the tick, the way"},
      {"pose_delay_ms", "the server's own: it samples poses this far back, which is part of every latency"},
      {"others_age_p50_ms", "as frame_age, of every frame of other clients' characters"},
      {"others_interval_p50_ms", "from one frame of another's character to the next"},
      {"hands_latency_p50_ms",
       "with touch_share: a hand's intended capture to the arrival at another client of hands sampled at or after it, "
       "and with them of the hair that they move"},
      {"hands_sent", "samples of all hands of a client; holds of hair, holds_empty, points_per_hold"},
      {"props_latency_p50_ms",
       "with props_share: a client's intended change of a prop to its arrival at another client of the room"},
      {"props_sent", "changes of props by clients with hands; 0 also where the server permits none"},
      {"jitter_p99_ms", "how far arrivals are from being as far apart as their ticks"},
      {"join_p99_ms", "from a client's intended arrival, or lost connection, to a character's first frame"},
      {"generator_lag_p99_ms", "from an intended time to the generator's doing it: above a bound nothing here counts"},
      {"frames", "of own characters; frames_of_others; frames_per_character_s"},
      {"frames_missed_share", "of own frames that were due, by tick and stride; frames_missed"},
      {"gap_ticks_max", "longest time from one own frame to the next; 1: at every tick, or at every one of its stride"},
      {"frames_discontinuous_share", "after teleports, resets and changes of level"},
      {"level_high_share", "of frames, by level: high, medium, low, ether, learnt, rigid"},
      {"stride_1_share", "of frames, by the ticks to the next: 1, 2, 4"},
      {"poses_unsent_share", "of intended poses, without a session to send them in; poses_unsent"},
      {"poses_unanswered_share", "sent, and never in a frame (their waiting counts as latency); poses_unanswered"},
      {"poses_asleep_share", "of characters at rest, which owe no frame"},
      {"joins_unanswered", "characters whose first frame never came; joins: the others"},
      {"resumes", "lost connections after which the session went on; restarts: after which it began again"},
      {"frames_undecodable", "their bytes were wrong"},
      {"errors", "all of error.REASON: connections lost, refusals and goodbyes, of well-behaved clients"},
      {"characters", "mean of the stage; clients"},
      {"bytes_in_per_character_s",
       "all packets from the server; bytes_out_, content_bytes_ (of frames: poses and nodes)"},
      {"bytes_in_per_frame", "likewise; content_bytes_per_frame"},
      {"generator_cpu_cores", "of this program; generator_cpu_us_per_character_s"},
      {"server_cpu_cores", "with --spawn or --server-pid; server_cpu_us_per_character_s"},
      {"server_resident_mib", "at the stage's end; server_resident_growth_mib meanwhile, server_resident_peak_mib"},
      {"builds_resident_peak_mib", "of the server's child processes, which build grooms"},
      {"server_ticks_skipped", "from /metrics; server_ticks_late, server_ticks_overrun"},
      {"late_joiner_ready_s",
       "with attacks: from a user's coming until a groom of its own is ready; late_joiner_welcome_s"},
      {"healthz_max_s", "with attacks: the slowest answer of /healthz, which is asked for once a second"},
      {"frames_missed_share_over_calm",
       "of an attack: beyond the calm stage before it; latency_p99_ms_, level_high_share_over_calm"},
      {"server_resident_after_mib_over_calm", "of an attack: at the end of the calm stage after it"},
      {"frames_checked", "with --check; check_failures"}};
  return names;
}

}  // namespace hairnet::load
