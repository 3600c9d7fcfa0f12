#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <set>

#include "server/room/command.hpp"
#include "server/room/groom_desk.hpp"
#include "server/tick/groom_builder.hpp"
#include "server/tick/tick_counters.hpp"

namespace hairnet::server {

struct GroomStoreLimits {
  std::size_t groom_bytes_max = std::size_t{64} << 20;    // of one groom
  std::size_t upload_bytes_max = std::size_t{256} << 20;  // of all unfinished and waiting uploads, as announced
  std::size_t level_bytes_max = std::size_t{1} << 30;     // of all levels
  std::size_t groom_count_max = 1024;
  std::size_t grooms_per_session_max = 64;
  std::size_t build_queue_max = 16;
  std::int64_t upload_timeout_ns = 30'000'000'000;  // without a chunk
  GroomLimits groom;
};

// Grooms by content, from offer to levels. One upload serves all who offer the same hash; when its uploader leaves or
// stalls, the next goes on from there. Levels that no session holds stay as long as there is room. I/O thread.
class GroomStore final : public GroomDesk {
 public:
  using Notify = std::function<void(SessionId, const wire::Message&, std::int64_t now_ns)>;
  GroomStore(const GroomStoreLimits& limits, GroomBuilder& builder, CommandQueue& commands, GroomCounters& counters,
             Notify notify);

  Refused offer(SessionId session, const wire::GroomOffer& offer, std::int64_t now_ns) override;
  Refused chunk(SessionId session, wire::GroomChunk chunk, std::int64_t now_ns) override;
  Refused hold(SessionId session, const wire::GroomHash& groom) override;
  [[nodiscard]] bool ready(const wire::GroomHash& groom) const;
  void tell_states(SessionId session, std::int64_t now_ns) override;
  std::shared_ptr<const std::vector<std::uint8_t>> bytes(const wire::GroomHash& groom) override;
  void release(SessionId session, std::int64_t now_ns) override;
  void poll(std::int64_t now_ns);  // results of the builder, stalled uploads

  [[nodiscard]] std::size_t groom_count() const { return grooms_.size(); }
  [[nodiscard]] std::size_t holder_count() const;  // of all grooms; a session counts once for each
  [[nodiscard]] std::size_t upload_bytes() const { return upload_bytes_; }
  [[nodiscard]] std::size_t level_bytes() const { return level_bytes_; }

 private:
  enum class State : std::uint8_t { uploading, queued, building, ready };
  struct Entry {
    State state = State::uploading;
    std::uint64_t byte_count = 0, received = 0;
    std::vector<std::vector<std::uint8_t>> chunks;
    SessionId uploader = 0;
    std::int64_t progress_ns = 0;
    std::set<SessionId> holders;
    std::size_t level_bytes = 0;                             // and those of the file
    std::shared_ptr<const std::vector<std::uint8_t>> bytes;  // of the file, once ready
    std::uint64_t used = 0;  // order of last use, to evict by
  };
  using Grooms = std::map<wire::GroomHash, Entry>;

  static wire::GroomState state_of(const Entry& entry);
  [[nodiscard]] std::size_t held_by(SessionId session) const;
  Refused begin_upload(SessionId session, const wire::GroomOffer& offer, std::int64_t now_ns);
  Refused finish_upload(Grooms::iterator groom, std::int64_t now_ns);
  // Lets another holder go on with the upload; drops it when there is none.
  void pass_on(Grooms::iterator groom, std::int64_t now_ns);
  void take(GroomResult result, std::int64_t now_ns);
  void take_ready(Grooms::iterator groom, GroomResult result, std::int64_t now_ns);
  void take_refused(Grooms::iterator groom, const GroomResult& result, std::int64_t now_ns);
  void tell_state(Grooms::const_iterator groom, wire::GroomState state, std::int64_t now_ns);
  void erase(Grooms::iterator groom);
  bool evict_one();  // the least recently used of those ready and not held

  GroomStoreLimits limits_;
  GroomBuilder* builder_;
  CommandQueue* commands_;
  GroomCounters* counters_;
  Notify notify_;
  Grooms grooms_;
  std::size_t upload_bytes_ = 0, level_bytes_ = 0;
  std::uint64_t uses_ = 0;
};

}  // namespace hairnet::server
