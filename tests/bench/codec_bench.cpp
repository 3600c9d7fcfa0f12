#include "tests/bench/codec_bench.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "core/world/world.hpp"
#include "tests/bench/stopwatch.hpp"
#include "tests/support/corpus.hpp"

namespace hairnet::bench {
namespace {

using codec::FrameIntegers;

std::vector<FrameIntegers> quantised(const CodecClip& clip, codec::ErrorClass error_class) {
  std::vector<FrameIntegers> out;
  for (std::size_t t = 0; t < clip.poses.size(); ++t) {
    FrameIntegers frame;
    codec::quantise_pose(clip.poses[t], out.empty() ? nullptr : &out.back(), frame);
    codec::quantise_nodes(clip.displacements[t], error_class, frame.nodes);
    out.push_back(std::move(frame));
  }
  return out;
}

// A frame and its history.
struct Job {
  const FrameIntegers* frame;
  std::vector<const FrameIntegers*> history;
  std::vector<std::uint8_t> bytes;
};

// From the fourth frame on, or when the history is there.
std::vector<Job> jobs_of(const std::vector<FrameIntegers>& frames, const CodecCase& what) {
  std::vector<Job> jobs;
  for (std::size_t t = std::max(codec::kHistoryMax, what.order * what.stride); t < frames.size(); ++t) {
    Job& job = jobs.emplace_back(Job{&frames[t], {}, {}});
    for (std::size_t n = 1; n <= what.order; ++n) job.history.push_back(&frames[t - n * what.stride]);
  }
  return jobs;
}

std::size_t bone_bytes(const Job& job) {
  const auto without_nodes = [](const FrameIntegers& frame) { return FrameIntegers{frame.bones, {}, {}}; };
  std::vector<FrameIntegers> past;
  for (const FrameIntegers* earlier : job.history) past.push_back(without_nodes(*earlier));
  std::vector<const FrameIntegers*> history;
  for (const FrameIntegers& earlier : past) history.push_back(&earlier);
  std::vector<std::uint8_t> bytes;
  codec::encode_frame(without_nodes(*job.frame), history, nullptr, bytes);
  return bytes.size();
}

void time(std::vector<Job>& jobs, const codec::Neighbours& neighbours, int repetitions, CodecResult& result) {
  FrameIntegers got;
  std::vector<std::uint8_t> bytes;
  std::vector<TimedRun> laps;
  laps.push_back({"encode", [] {},
                  [&] {
                    for (const Job& job : jobs) {
                      bytes.clear();
                      codec::encode_frame(*job.frame, job.history, &neighbours, bytes);
                    }
                  }});
  laps.push_back({"decode", [] {},
                  [&] {
                    for (const Job& job : jobs)
                      result.right &= codec::decode_frame(job.bytes, job.history, &neighbours, false, got);
                  }});
  measure(laps, repetitions);
  const double per_frame = 1e9 / static_cast<double>(jobs.size());
  result.encode_ns = laps[0].seconds_min * per_frame;
  result.decode_ns = laps[1].seconds_min * per_frame;
}

}  // namespace

std::vector<CodecClip> step_clips(const Subject& subject, LevelIndex index, double rate_hz, double duration_s) {
  auto levels = std::make_shared<LevelSet>();
  const auto i = static_cast<std::size_t>(index);
  levels->levels[i] = *build_level(subject.groom, kLevelSpecs[i]);
  std::vector<CodecClip> clips;
  for (const Motion& motion : subject.motions) {
    const fidelity::Clip clip = fidelity::make_clip(motion, rate_hz, duration_s);
    WorldDef def;
    def.tick_s = 1 / rate_hz;
    World world(def);
    const CharacterId id = world.add({levels, index, clip.poses.front()});
    CodecClip& out = clips.emplace_back();
    for (std::size_t t = 1; t < clip.poses.size(); ++t) {
      world.set_pose(id, clip.poses[t]);
      world.step();
      if (t <= clip.lead_in_ticks) continue;
      const LatticeView lattice = world.lattice(id);
      out.poses.push_back(*lattice.pose);
      out.displacements.emplace_back(lattice.displacement.begin(), lattice.displacement.end());
    }
  }
  return clips;
}

CodecResult measure_codec(const LevelGeometry& geometry, const std::vector<CodecClip>& clips, const CodecCase& what,
                          int repetitions) {
  const codec::Neighbours neighbours(geometry);
  CodecResult result;
  std::vector<std::vector<FrameIntegers>> frames;
  std::vector<Job> jobs;
  for (const CodecClip& clip : clips) {
    frames.push_back(quantised(clip, what.error_class));
    for (Job& job : jobs_of(frames.back(), what)) jobs.push_back(std::move(job));
  }
  if (jobs.empty()) return result;
  std::size_t bytes = 0, of_bones = 0;
  for (Job& job : jobs) {
    codec::encode_frame(*job.frame, job.history, &neighbours, job.bytes);
    FrameIntegers got;
    result.right &= codec::decode_frame(job.bytes, job.history, &neighbours, false, got) &&
                    got.bones == job.frame->bones && got.nodes == job.frame->nodes;
    bytes += job.bytes.size();
    of_bones += bone_bytes(job);
  }
  const auto count = static_cast<double>(jobs.size());
  result.frames = jobs.size();
  result.bytes_a_frame = static_cast<double>(bytes) / count;
  result.bone_bytes_a_frame = static_cast<double>(of_bones) / count;
  result.share_of_raw =
      (result.bytes_a_frame - result.bone_bytes_a_frame) / static_cast<double>(6 * geometry.active_nodes.size());
  if (repetitions > 0) time(jobs, neighbours, repetitions, result);
  return result;
}

double share_of_prototype(const std::vector<CodecClip>& clips, codec::ErrorClass error_class) {
  constexpr std::size_t kBlock = 16;
  constexpr unsigned kParameterBits = 4, kParameterMax = 15;
  std::size_t bits = 0, coordinates = 0;
  for (const CodecClip& clip : clips) {
    const std::vector<FrameIntegers> frames = quantised(clip, error_class);
    for (std::size_t t = codec::kHistoryMax; t < frames.size(); ++t) {
      const auto &x = frames[t].nodes, &a = frames[t - 1].nodes, &b = frames[t - 2].nodes, &c = frames[t - 3].nodes;
      for (std::size_t begin = 0; begin < x.size(); begin += kBlock) {
        const std::size_t end = std::min(begin + kBlock, x.size());
        std::size_t least = std::numeric_limits<std::size_t>::max();
        for (unsigned k = 0; k <= kParameterMax; ++k) {
          std::size_t block = kParameterBits;
          for (std::size_t i = begin; i < end; ++i) {
            const int left = x[i] - ((19 * a[i] - 15 * b[i] + 4 * c[i] + 4) >> 3);
            block += (static_cast<unsigned>(left < 0 ? -2 * left - 1 : 2 * left) >> k) + 1 + k;
          }
          least = std::min(least, block);
        }
        bits += least;
      }
      coordinates += x.size();
    }
  }
  return coordinates == 0 ? 0 : static_cast<double>(bits) / static_cast<double>(16 * coordinates);
}

}  // namespace hairnet::bench
