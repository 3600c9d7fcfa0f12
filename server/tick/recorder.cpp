#include "server/tick/recorder.hpp"

#include <spdlog/spdlog.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "core/assert.hpp"
#include "server/telemetry/log_text.hpp"

namespace hairnet::server {
namespace {

// Copies a shared groom only here, on the recorder's thread.
wire::RecordEntry to_entry(
    std::variant<wire::RecordingHeader, Recorder::Bytes, wire::RecordedLearnt, wire::RecordedTick>& item) {
  if (auto* header = std::get_if<wire::RecordingHeader>(&item)) return *header;
  if (auto* bytes = std::get_if<Recorder::Bytes>(&item)) return wire::RecordedGroom{**bytes};
  if (auto* learnt = std::get_if<wire::RecordedLearnt>(&item)) return *learnt;
  return std::move(std::get<wire::RecordedTick>(item));
}

}  // namespace

Result<std::unique_ptr<Recorder>> Recorder::create(const std::string& path, TickCounters& counters) {
  std::FILE* file = std::fopen(path.c_str(), "wb");
  if (!file) return Refusal("cannot write the recording " + path + ": " + std::strerror(errno));
  return std::unique_ptr<Recorder>(new Recorder(file, path, counters));
}

Recorder::Recorder(std::FILE* file, std::string path, TickCounters& counters)
    : file_(file), path_(std::move(path)), counters_(&counters), queue_(kQueueBytesMax) {
  HAIRNET_ASSERT(file_);
}

void Recorder::put(const wire::RecordingHeader& header) {
  put(Item(std::in_place_type<wire::RecordingHeader>, header), sizeof(header));
}

void Recorder::put_groom(Bytes bytes) {
  HAIRNET_ASSERT(bytes);
  const std::size_t count = bytes->size();
  put(std::move(bytes), count);
}

void Recorder::put(const wire::RecordedLearnt& learnt) {
  HAIRNET_ASSERT(learnt.hair);
  put(Item(std::in_place_type<wire::RecordedLearnt>, learnt), sizeof(learnt) + learnt.hair->bytes());
}

void Recorder::put(wire::RecordedTick tick) {
  const auto bytes_of = [](const auto&... lists) { return (... + (lists.size() * sizeof(lists[0]))); };
  // The weight is about the memory that the entry occupies while it waits, not its size on the disk.
  std::size_t bytes = sizeof(tick) + bytes_of(tick.removed, tick.added, tick.levels, tick.materials, tick.strides,
                                              tick.suspensions, tick.states, tick.winds, tick.poses, tick.touch_rules,
                                              tick.bodies, tick.releases, tick.grabs);
  for (const wire::RecordedState& state : tick.states) bytes += bytes_of(state.displacements, state.velocities);
  for (const SimulationInputs::Rule& change : tick.touch_rules) bytes += bytes_of(change.rule.chosen);
  for (const SimulationInputs::RoomBodies& room : tick.bodies) bytes += bytes_of(room.bodies);
  put(std::move(tick), bytes);
}

void Recorder::put(Item&& item, std::size_t bytes) {
  HAIRNET_ASSERT(bytes > 0);
  if (failed()) return;
  // A recording with a gap could not be replayed, so it ends here and stays valid up to this tick.
  if (!queue_.try_put(item, bytes)) return fail("the disk is too slow");
  if (on_put) on_put();
}

bool Recorder::poll() {
  queue_.take_all(taken_);
  if (taken_.empty()) return false;
  for (Item& item : taken_) {
    // The rest of the queue is taken and dropped, so its memory is free again.
    if (!file_) break;
    const bool is_tick = std::holds_alternative<wire::RecordedTick>(item);
    const std::vector<std::uint8_t> bytes = wire::encode_record_entry(to_entry(item));
    if (std::fwrite(bytes.data(), 1, bytes.size(), file_.get()) != bytes.size()) {
      fail(std::strerror(errno));
      file_.reset();
    } else if (is_tick) {
      counters_->ticks_recorded.add();
    }
  }
  taken_.clear();
  // After a crash the file has all entries but those of the last moment.
  if (file_ && std::fflush(file_.get()) != 0) {
    fail(std::strerror(errno));
    file_.reset();
  }
  return true;
}

void Recorder::fail(const char* error) {
  // The first error is the cause; later ones follow from it.
  if (failed_.exchange(true)) return;
  counters_->recordings_failed.add();
  spdlog::error("event=recording_failed file={} detail={}", log_text(path_), log_text(error));
}

}  // namespace hairnet::server
