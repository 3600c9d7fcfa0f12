#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <span>
#include <vector>

#include "core/assert.hpp"
#include "core/modes/make_modes.hpp"
#include "core/parallel_for.hpp"
#include "core/world/simulation.hpp"
#include "schema/codec/frame.hpp"
#include "schema/wire/recording.hpp"
#include "server/room/room.hpp"
#include "server/tick/tick_counters.hpp"

namespace hairnet::server {

// The settings of Publisher; Scheduler fills in the tick and the clock.
struct PublishDef {
  // The frames of one reliable packet have at most this many bytes (SessionLimits::frame_packet_bytes_max).
  std::size_t packet_bytes_max = std::size_t{256} << 10;
  double tick_s = 1.0 / 30;
  // Null: times are not measured.
  ClockNs now_ns = nullptr;
};

// Makes each observer's packets from the lattices, in four parallel loops. The first finds the characters that have
// changed. The second finds, room by room, how large an error of each character each observer may see. The third codes
// each character once, and cuts the code for each of these errors. The last puts the packets together. Tick thread and
// workers. Each turn of a loop writes to one character, room or observer only, so no loop needs a lock. Threads share
// only counters and sinks.
class Publisher {
 public:
  Publisher(const PublishDef& def, TickCounters& counters) : def_(def), counters_(&counters) {
    HAIRNET_ASSERT(def.packet_bytes_max <= wire::kPacketBytesMax - wire::kPacketOverheadBytesMax);
  }

  // Sends the frames of one tick. Call it after the step. Characters and observers in `rooms` get the tick's variants
  // and times, which LevelChooser::observe() reads afterwards.
  void publish(Rooms& rooms, const Simulation& simulation, const wire::RecordedTick& tick,
               const ParallelFor& parallel_for, std::int64_t now_ns);
  // Frames of the groom may carry coefficients from now on. `basis`: the hash of its file. Asserts that the levels have
  // modes.
  void put_basis(const wire::GroomHash& groom, const wire::GroomHash& basis,
                 const std::shared_ptr<const LevelSet>& levels);
  // Clients may evaluate the groom's learnt hair from now on. `learnt`: the hash of its file.
  void put_learnt(const wire::GroomHash& groom, const wire::GroomHash& learnt);
  // Frames of the groom carry poses alone from now on.
  void forget_groom(const wire::GroomHash& groom);

 private:
  // The basis of a groom that sessions may know: the hash of its file, the modes that turn the groom's lattices into
  // coefficients, and the code that turns coefficients into bits.
  struct KnownBasis {
    wire::GroomHash hash{};
    std::shared_ptr<const Modes> modes;
    codec::CoefficientCode code;
  };

  // Up to kModeMapWidth characters of one basis and level, whose coefficients one map computes side by side.
  struct Batch {
    // Null: only poses are sent.
    const KnownBasis* basis = nullptr;
    // Null: there is no lattice, so there is nothing to compute.
    const ModeMap* map = nullptr;
    std::size_t count = 0;
    std::array<Character*, kModeMapWidth> characters{};
  };

  // Gathers frames into packets; defined in publish.cpp.
  class Packer;
  // The arguments of one publish(), which its loops only read.
  struct Terms {
    Rooms& rooms;
    const Simulation& simulation;
    const wire::RecordedTick& tick;
    std::int64_t now_ns;
  };
  // Decides whether the character has anything to send at this tick (Character::changed and asleep).
  void begin_frame(const Terms& terms, Character& character);
  // Chooses the frames of all observers of the room.
  void request(const Terms& terms, Room& room) const;
  // Chooses the observer's frames of this tick (Observer::requests). Returns the stride at which frames are sent to the
  // observer.
  int request(const Terms& terms, const Room& room, Observer& observer) const;
  // Fills batches_ with the characters whose frames an observer gets.
  void gather_batches(std::span<Character* const> everyone);
  // Code the frames of a batch, and of one character in all its variants.
  void encode(const Terms& terms, const Batch& batch) const;
  void encode(const Terms& terms, Character& character, const KnownBasis* basis, const HairMotion& motion) const;
  // Sends the observer the hash of the basis of the character's groom, if it has not been sent before. The client then
  // downloads the basis.
  void announce_basis(const Terms& terms, const Character& character, Observer& observer) const;
  // Whether the observer evaluates the hair of this frame itself. Announces learnt hair to an observer that sees it.
  bool note_learnt(const Terms& terms, const Character& character, Observer& observer, View& view) const;
  // The basis by which the character's lattice is coded. Null: its frames carry only the pose.
  [[nodiscard]] const KnownBasis* basis_of(const Character& character) const;
  // Puts the observer's frames and hands of this tick into packets, and these into its sink.
  void send(const Terms& terms, Observer& observer) const;

  // The time for measurements; always 0 without a clock.
  [[nodiscard]] std::int64_t clock_ns() const { return def_.now_ns ? def_.now_ns() : 0; }

  PublishDef def_;
  TickCounters* counters_;
  std::map<wire::GroomHash, KnownBasis> bases_;
  // By groom: the hash of its file of learnt hair.
  std::map<wire::GroomHash, wire::GroomHash> learnt_;
  // The observers that have a sink, and the batches, both of the tick that is being published.
  std::vector<Observer*> observers_;
  std::vector<Batch> batches_;
};

}  // namespace hairnet::server
