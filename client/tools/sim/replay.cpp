#include "client/tools/sim/replay.hpp"

#include <algorithm>
#include <cstdio>
#include <span>
#include <utility>
#include <vector>

#include "client/files/frame_trace.hpp"
#include "client/files/npy_writer.hpp"
#include "client/files/read_file.hpp"
#include "client/tools/command_line/progress_bar.hpp"
#include "client/tools/sim/replayed_world.hpp"
#include "client/tools/sim/trajectory_files.hpp"

namespace hairnet::sim {
namespace {

// The nodes of one character in the world, a row for each tick at which it has a lattice. Ticks without one have no
// row.
class NodeFile {
 public:
  NodeFile(std::string path, std::uint64_t character) : path_(std::move(path)), character_(character) {}

  Result<void> add(std::uint64_t tick, const ReplayedWorld& replayed) {
    for (const auto& [key, groom] : replayed.characters()) {
      // The lower half is the client's own number, the upper one the session.
      if (key != character_ && (key & 0xffffffff) != character_) continue;
      const LatticeView view = replayed.simulation().lattice(key);
      // Without a model there is no lattice, as for rigid hair.
      if (view.model == nullptr) continue;
      if (const Result<void> opened = open(tick, key, *view.model); !opened) return opened;
      writer_->append(nodes_->positions(view.pose->head(), view.displacement));
    }
    return {};
  }
  Result<void> finish() {
    // Without a row the number of nodes is not known.
    if (!writer_) return Refusal("character " + std::to_string(character_) + " never has a lattice in this recording");
    if (const Result<void> finished = writer_->finish(); !finished) return Refusal(path_ + ": " + finished.error());
    return {};
  }

 private:
  // Opens the array at the first row. An array has one shape, so it needs one character with one lattice: a change of
  // lattice, or two characters of the same number, is an error.
  Result<void> open(std::uint64_t tick, std::uint64_t key, const Level& level) {
    if (writer_ && key == key_ && &level == level_) return {};
    if (writer_)
      return Refusal("character " + std::to_string(character_) +
                     (key == key_ ? " changes its level" : " is not the only one of that number") + " at tick " +
                     std::to_string(tick) + ": use --trace");
    Result<NpyWriter> writer = NpyWriter::create(path_, NpyType::float32, {level.geometry.lattice.node_count(), 3});
    if (!writer) return Refusal(path_ + ": " + writer.error());
    writer_ = std::move(*writer);
    nodes_.emplace(level.geometry);
    key_ = key;
    level_ = &level;
    return {};
  }

  std::string path_;
  // The character as the user names it, by its own number or by its whole key, and the key of the one that is written.
  std::uint64_t character_, key_ = 0;
  const Level* level_ = nullptr;
  std::optional<NpyWriter> writer_;
  std::optional<GridNodes> nodes_;
};

// The strands of one character in the world, a frame for each tick from its first one on. Levels may change, since
// strands do not.
class StrandsFile {
 public:
  StrandsFile(std::string path, std::uint64_t character) : path_(std::move(path)), character_(character) {}

  Result<void> add(std::uint64_t tick, const ReplayedWorld& replayed) {
    for (const auto& [key, groom] : replayed.characters()) {
      if ((key != character_ && (key & 0xffffffff) != character_) || replayed.groom(key) == nullptr) continue;
      if (const Result<void> ready = open(tick, key, groom, replayed); !ready) return ready;
      const std::span<const Vec3f> points = points_->at(replayed.simulation().lattice(key).pose->head(),
                                                        replayed.lattice_of(key), replayed.displacement(key, scratch_));
      if (const Result<void> added = cache_->add(points); !added) return added;
      // open() writes these points again for ticks at which the character is away.
      last_.assign(points.begin(), points.end());
      tick_ = tick;
    }
    return {};
  }
  Result<void> finish() {
    if (!cache_) return Refusal("character " + std::to_string(character_) + " is not in this recording");
    return cache_->finish();
  }

 private:
  // Makes the file ready for the frame of this tick. Where the character was away for a moment, or the server left
  // ticks out, the hair stands still: a file of frames has no gaps.
  Result<void> open(std::uint64_t tick, std::uint64_t key, const wire::GroomHash& groom,
                    const ReplayedWorld& replayed) {
    // After a longer absence the file would get frames of still hair for hours; the character's return is then mostly
    // another visit.
    constexpr double kAwayMax_s = 60;
    if (!cache_) {
      auto cache = StrandCache::create(path_, *replayed.groom(key), {replayed.rate_hz(), {}});
      if (!cache) return Refusal(cache.error());
      cache_ = std::move(*cache);
      points_.emplace(*replayed.groom(key));
      key_ = key;
      groom_ = groom;
      return {};
    }
    const std::string who = "character " + std::to_string(character_), when = " at tick " + std::to_string(tick);
    if (key != key_) return Refusal(who + " is not the only one of that number" + when + ": use its session too");
    // Strands of another groom do not fit into the file.
    if (groom != groom_) return Refusal(who + " has another hairstyle" + when);
    if (tick <= tick_ || static_cast<double>(tick - tick_) > kAwayMax_s * replayed.rate_hz())
      return Refusal(who + " was away for too long" + when);
    while (++tick_ < tick) {
      if (const Result<void> added = cache_->add(last_); !added) return added;
    }
    return {};
  }

  std::string path_;
  // The character as the user names it, the key of the one that is written, and the tick of the last frame.
  std::uint64_t character_, key_ = 0, tick_ = 0;
  wire::GroomHash groom_{};
  std::unique_ptr<StrandCache> cache_;
  std::optional<WorldPoints> points_;
  // `scratch_` is memory for `displacement`, and `last_` holds the points of the last frame.
  std::vector<Vec3f> scratch_, last_;
};

// The files that a replay writes, at most one of nodes or strands.
struct ReplayFiles {
  std::optional<NodeFile> nodes;
  std::optional<StrandsFile> strands;
  std::optional<FrameTrace> trace;
  std::vector<Vec3f> scratch;

  static Result<ReplayFiles> create(const ReplayOptions& o) {
    ReplayFiles files;
    if (is_exported_motion(o.out)) {
      files.strands.emplace(o.out, *o.character);
    } else if (!o.out.empty()) {
      files.nodes.emplace(o.out, *o.character);
    }
    if (!o.trace.empty()) {
      Result<FrameTrace> trace = FrameTrace::create(o.trace);
      if (!trace) return Refusal(trace.error());
      files.trace = std::move(*trace);
    }
    return files;
  }
  Result<void> add(std::uint64_t tick, const ReplayedWorld& replayed) {
    if (trace) {
      for (const auto& [key, groom] : replayed.characters()) {
        const LatticeView view = replayed.simulation().lattice(key);
        // A replay sends no frames, so none is discontinuous; the README of client/files says so.
        trace->add({tick, key, view.level, false, view.asleep, *view.pose, replayed.displacement(key, scratch)});
      }
    }
    if (strands) return strands->add(tick, replayed);
    return nodes ? nodes->add(tick, replayed) : Result<void>();
  }
  Result<void> finish() {
    if (trace) {
      if (const Result<void> finished = trace->finish(); !finished) return finished;
    }
    if (strands) return strands->finish();
    return nodes ? nodes->finish() : Result<void>();
  }
};

struct Totals {
  std::size_t ticks = 0, grooms = 0, characters_max = 0;
};

// Reads entry after entry until the end, or until an error: the damaged entry and all behind it are left out.
Result<void> replay_entries(std::span<const std::uint8_t> bytes, ReplayedWorld& replayed, ReplayFiles& files,
                            ProgressBar& bar, Totals& totals) {
  const std::size_t byte_count = bytes.size();
  while (!bytes.empty()) {
    const Result<wire::RecordEntry> entry = wire::take_record_entry(bytes);
    if (!entry) return Refusal(entry.error());
    // Entries are only trusted as far as ReplayedWorld checks them.
    const Result<void> taken = std::visit([&](const auto& e) { return replayed.take(e); }, *entry);
    if (!taken) return taken;
    totals.grooms += std::holds_alternative<wire::RecordedGroom>(*entry);
    if (const auto* tick = std::get_if<wire::RecordedTick>(&*entry)) {
      ++totals.ticks;
      totals.characters_max = std::max(totals.characters_max, replayed.characters().size());
      // Files are written after the hash has been compared: they hold states that the server had.
      if (const Result<void> written = files.add(tick->tick, replayed); !written) return written;
    }
    bar.show(1 - static_cast<double>(bytes.size()) / static_cast<double>(byte_count), "replaying");
  }
  return {};
}

}  // namespace

Result<void> replay(const ReplayOptions& o) {
  const Result<std::vector<std::byte>> bytes = read_file(o.recording);
  if (!bytes) return Refusal(o.recording + ": " + bytes.error());
  Result<ReplayFiles> files = ReplayFiles::create(o);
  if (!files) return Refusal(files.error());

  Totals totals;
  Result<void> replayed_all;
  {
    ProgressBar bar("hairnet-sim");
    ReplayedWorld replayed([&bar](double fraction, std::string_view stage) { bar.show(fraction, stage); });
    replayed_all = replay_entries({reinterpret_cast<const std::uint8_t*>(bytes->data()), bytes->size()}, replayed,
                                  *files, bar, totals);
  }
  // Files are finished also after an error: the ticks before it are worth keeping.
  const Result<void> finished = files->finish();
  std::printf("%zu ticks replayed, at most %zu characters, %zu grooms: %s\n", totals.ticks, totals.characters_max,
              totals.grooms, replayed_all ? "every state hash equal" : "not to the end");
  // The recording's error explains more than one of a file.
  if (!replayed_all) return Refusal(o.recording + ": " + replayed_all.error());
  return finished;
}

}  // namespace hairnet::sim
