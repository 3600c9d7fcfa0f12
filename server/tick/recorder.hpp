#pragma once

#include <atomic>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "core/result.hpp"
#include "schema/wire/recording.hpp"
#include "server/threading/bounded_queue.hpp"
#include "server/tick/tick_counters.hpp"

namespace hairnet::server {

// Writes the recording. The tick thread queues entries and the recorder's thread writes them, so a tick never waits for
// the disk. A full disk or a full queue ends the recording; the file is then valid up to that point.
class Recorder {
 public:
  using Bytes = std::shared_ptr<const std::vector<std::uint8_t>>;
  // Entries that wait for the disk have at most this many bytes together.
  static constexpr std::size_t kQueueBytesMax = std::size_t{256} << 20;

  static Result<std::unique_ptr<Recorder>> create(const std::string& path, TickCounters& counters);

  // All put() are for the tick thread. They never wait, and do nothing once the recording has failed.
  void put(const wire::RecordingHeader& header);
  void put_groom(Bytes bytes);
  void put(const wire::RecordedLearnt& learnt);
  void put(wire::RecordedTick tick);
  [[nodiscard]] bool failed() const { return failed_.load(std::memory_order_relaxed); }

  // Writes the queued entries, on the recorder's thread. False when there were none.
  bool poll();

  // Wakes the recorder's thread. Set it before ticks run.
  std::function<void()> on_put;

 private:
  // An entry that waits for the disk. Bytes is a groom's file.
  using Item = std::variant<wire::RecordingHeader, Bytes, wire::RecordedLearnt, wire::RecordedTick>;
  struct CloseFile {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  Recorder(std::FILE* file, std::string path, TickCounters& counters);
  // The function is not inlined: otherwise g++ 12 sees which alternative the item has, and warns that the others are
  // uninitialised.
  [[gnu::noinline]] void put(Item&& item, std::size_t bytes);
  // Ends the recording, and logs the first error. Either thread.
  void fail(const char* error);

  // The open file; null once writing has failed. Recorder thread.
  std::unique_ptr<std::FILE, CloseFile> file_;
  std::string path_;
  TickCounters* counters_;
  BoundedQueue<Item> queue_;
  // The entries that poll() has taken from the queue. Recorder thread.
  std::vector<Item> taken_;
  // Either thread sets it: the tick thread when the queue is full, the recorder's when the disk is.
  std::atomic<bool> failed_{false};
};

}  // namespace hairnet::server
