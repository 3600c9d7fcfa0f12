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

struct PublishDef {
  std::size_t packet_bytes_max = std::size_t{256} << 10;
  double tick_s = 1.0 / 30;
  // Null: times are not measured.
  ClockNs now_ns = nullptr;
};

// Makes each observer's packets from the lattices, in four parallel loops: find the characters that changed; choose for
// each observer how fine they need to be; code each once; put the packets together. Tick thread and workers. Loops
// write to one character, room or observer each, so no loop needs a lock. Counts and sinks are the only things that
// threads share.
class Publisher {
 public:
  Publisher(const PublishDef& def, TickCounters& counters) : def_(def), counters_(&counters) {
    HAIRNET_ASSERT(def.packet_bytes_max <= wire::kPacketBytesMax - wire::kPacketOverheadBytesMax);
  }

  // Sends the frames of one tick, after the step. `rooms` get the tick's variants and times, which LevelChooser reads
  // afterwards.
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
  // What turns a groom's lattices into coefficients, and these into bits.
  struct KnownBasis {
    wire::GroomHash hash{};
    std::shared_ptr<const Modes> modes;
    codec::CoefficientCode code;
  };

  // Characters whose coefficients one map computes at once. No map: there is nothing to compute.
  struct Batch {
    // Null: only poses are sent.
    const KnownBasis* basis = nullptr;
    const ModeMap* map = nullptr;
    std::size_t count = 0;
    std::array<Character*, kModeMapWidth> characters{};
  };

  class Packer;
  // The arguments of one publish(), which its loops only read.
  struct Terms {
    Rooms& rooms;
    const Simulation& simulation;
    const wire::RecordedTick& tick;
    std::int64_t now_ns;
  };
  // Decides whether the character has anything to send at this tick.
  void begin_frame(const Terms& terms, Character& character);
  void request(const Terms& terms, Room& room) const;
  // Returns the stride at which frames are sent to the observer.
  int request(const Terms& terms, const Room& room, Observer& observer) const;
  // Groups the characters that somebody asked for by basis and level, so that one map computes several side by side.
  void gather_batches(std::span<Character* const> everyone);
  void encode(const Terms& terms, const Batch& batch) const;
  void encode(const Terms& terms, Character& character, const KnownBasis* basis, const HairMotion& motion) const;
  void announce_basis(const Terms& terms, const Character& character, Observer& observer) const;
  // Whether the observer evaluates the hair of this frame itself. Announces learnt hair to an observer that sees it.
  bool note_learnt(const Terms& terms, const Character& character, Observer& observer, View& view) const;
  [[nodiscard]] const KnownBasis* basis_of(const Character& character) const;
  void send(const Terms& terms, Observer& observer) const;

  [[nodiscard]] std::int64_t clock_ns() const { return def_.now_ns ? def_.now_ns() : 0; }

  PublishDef def_;
  TickCounters* counters_;
  std::map<wire::GroomHash, KnownBasis> bases_;
  // Has the hash of each groom's file of learnt hair.
  std::map<wire::GroomHash, wire::GroomHash> learnt_;
  // This and the next belong to the tick that is being published.
  std::vector<Observer*> observers_;
  std::vector<Batch> batches_;
};

}  // namespace hairnet::server
