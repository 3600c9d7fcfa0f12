#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <tuple>
#include <vector>

#include "server/grooms/groom_builder.hpp"
#include "server/grooms/groom_counters.hpp"
#include "server/grooms/groom_shares.hpp"
#include "server/grooms/groom_store_limits.hpp"

namespace hairnet::server {

// Decides which groom's levels are built next, and for how long. One groom is built at a time: that of the sharer whose
// builds have taken the least time, so a client with many or large grooms delays the others little. A build whose turn
// has lasted gives way, and begins again later with twice the time: a build cannot be paused, but doubled turns let
// each end at last. A build that fails by an error of the server is tried again, later each time. I/O thread.
class BuildTurns {
 public:
  // `shares`, `builder` and `counters` must outlive this object.
  BuildTurns(const GroomStoreLimits& limits, const GroomShares& shares, GroomBuilder& builder, GroomCounters& counters)
      : limits_(limits), shares_(&shares), builder_(&builder), counters_(&counters) {}

  // The groom waits for its turn from now on. The build counts as that of `owner`, who uploaded the groom or asked for
  // the cached one; zero is nobody, who comes last. Without chunks the file is in the groom cache.
  void queue(const wire::GroomHash& groom, SessionId owner, std::vector<std::vector<std::uint8_t>> chunks,
             std::int64_t now_ns);
  // Nobody waits for the groom any more. Its build under way ends soon.
  void erase(const wire::GroomHash& groom);
  // Forgets the time of a sharer that has no session any more.
  void forget(const Sharer& sharer) { build_ns_.erase(sharer); }
  // Ends the turn of the build under way if its time is over and a sharer with less build time waits. Gives the builder
  // the next groom when it has none.
  void poll(std::int64_t now_ns);

  enum class Progress : std::uint8_t {
    // The result belongs to no groom of the queue: it was dropped.
    none,
    building,
    // The groom waits again.
    queued,
    // The groom has left the queue; the result says how its build ended.
    ended,
  };
  // Takes a result of the builder, charges its time, and says what has become of the groom.
  Progress take(const GroomResult& result, std::int64_t now_ns);
  // Returns why a groom is refused whose build has ended without levels, and counts the refusal.
  Refused refusal_of(const GroomResult& result);

  // True when the builder has nothing to do, and no groom may begin. Grooms to prepare begin only then, so that they
  // delay no session's.
  [[nodiscard]] bool is_idle(std::int64_t now_ns) const;
  // True when no more uploaded grooms may wait.
  [[nodiscard]] bool is_full() const;
  // Returns a groom that has to leave the full queue so that one of the session can enter: the newest of the sharer
  // that has most there. Returns nullopt when that is the session's own.
  [[nodiscard]] std::optional<wire::GroomHash> to_drop_for(SessionId session) const;
  // The number of grooms that wait or are being built.
  [[nodiscard]] std::size_t count() const { return builds_.size(); }
  // The bytes of the files of these grooms, as far as they are in memory.
  [[nodiscard]] std::size_t bytes() const { return bytes_; }

 private:
  // A groom that waits for the builder or is being built.
  struct Build {
    // The session for which the groom is built; zero: none.
    SessionId owner = 0;
    // The number that the groom got when it came into the queue; lower numbers came earlier.
    std::uint64_t order = 0;
    // The file: `chunks` has the pieces of the upload until the builder takes them, `file` the whole file from then on.
    std::vector<std::vector<std::uint8_t>> chunks;
    std::shared_ptr<const std::vector<std::uint8_t>> file;
    // The size of the file; zero while it is only in the groom cache.
    std::size_t bytes = 0;
    // The builder's number for the job while it has the groom, else zero.
    std::uint64_t job = 0;
    // The groom is being built since this time, and need not give way before turn_ns have passed. turn_ns starts at
    // build_turn_ns and doubles each time the build gives way.
    std::optional<std::int64_t> since_ns;
    std::int64_t turn_ns = 0;
    // The part of the present build's time that was added to its owner's build_ns_.
    std::int64_t charged_ns = 0;
    // The builder was told to end its build.
    bool gives_way = false;
    // The number of builds of this groom that have failed by the server's error.
    int failed_count = 0;
    // No build of the groom begins before this time.
    std::int64_t again_ns = 0;
  };
  using Builds = std::map<wire::GroomHash, Build>;
  // Orders grooms by their turns: those whose owners have left come last, then those whose builds have taken more time.
  using Turn = std::tuple<bool, std::int64_t, std::uint64_t>;

  [[nodiscard]] Turn turn_of(const Build& build) const;
  // Returns the groom that begins next, or end() when none waits that may begin now.
  [[nodiscard]] Builds::const_iterator next(std::int64_t now_ns) const;
  // Gives the builder the next groom, if the builder has none.
  void feed(std::int64_t now_ns);
  // Ends the build under way if its turn is over and another sharer's groom comes before it.
  void end_turn(std::int64_t now_ns);
  // Adds the time that the build has taken so far, `taken_ns`, to the time of its owner.
  void charge(Build& build, std::int64_t taken_ns);
  // Plans the next try of a build that has failed by an error of the server. Returns false when it has been tried
  // build_count_max times, or its file is not in memory.
  bool try_again(const GroomResult& failed, Build& build, std::int64_t now_ns);
  void remove(Builds::const_iterator build);
  // True for a groom that waits with its file in memory; build_queue_max bounds such grooms. A file in the cache takes
  // no memory.
  static bool waits_with_file(const Build& build) { return build.job == 0 && build.bytes > 0; }

  GroomStoreLimits limits_;
  const GroomShares* shares_;
  GroomBuilder* builder_;
  GroomCounters* counters_;
  Builds builds_;
  // The time that the builds of each sharer have taken together.
  std::map<Sharer, std::int64_t> build_ns_;
  // The sum of Build::bytes.
  std::size_t bytes_ = 0;
  // The number of grooms that have come into the queue so far; see Build::order.
  std::uint64_t orders_ = 0;
  // The number of jobs given to the builder so far; see Build::job.
  std::uint64_t jobs_ = 0;
  // The builder has a job whose end has not come.
  bool is_builder_busy_ = false;
};

}  // namespace hairnet::server
