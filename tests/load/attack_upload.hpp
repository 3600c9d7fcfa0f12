#pragma once

#include <vector>

#include "core/random.hpp"
#include "tests/load/attacker.hpp"

namespace hairnet::load {

// Uploads a groom as fast as the server takes it. Once the server has refused or built the groom, the attacker uploads
// it again under another name, which makes it another groom.
class AttackUpload final : public Attacker {
 public:
  // `bytes` contain kAttackGroomName, whose digits each upload changes. `first` is the number of the first upload; no
  // two attackers may use the same numbers.
  AttackUpload(const AttackContext& context, std::uint32_t host, std::vector<std::uint8_t> bytes, std::uint32_t first);

 private:
  void begin(std::int64_t now_ns) override;
  void proceed(std::int64_t now_ns) override;
  void hear(const wire::Message& message, std::int64_t now_ns) override;
  void offer(std::int64_t now_ns);

  std::vector<std::uint8_t> bytes_;
  // The place of the name's first byte, and the number of bytes that are sent. `sent_` is bytes_.size() when nothing is
  // to be sent.
  std::size_t name_at_, sent_ = 0;
  std::uint32_t number_;
  wire::GroomHash hash_{};
  // The time at which the next groom is offered; kNever_ns while the server has one to answer.
  std::int64_t offer_ns_;
};

// Offers grooms whose bytes come slowly, or never.
struct SlowOffers {
  // The announced size of each groom.
  std::uint64_t byte_count = 0;
  double offers_hz = 0;
  std::uint32_t offers_max = 0;
  // The rate of single bytes of each groom, in bytes a second.
  double byte_hz = 0;
  // The attacker offers the groom of the stage's late joiner; otherwise it offers grooms that nobody has.
  bool is_late_joiners_groom = false;
};

class AttackOffers final : public Attacker {
 public:
  AttackOffers(const AttackContext& context, std::uint32_t host, SlowOffers attack);

 private:
  void begin(std::int64_t now_ns) override;
  void proceed(std::int64_t now_ns) override;
  void hear(const wire::Message& message, std::int64_t now_ns) override;

  SlowOffers attack_;
  Random random_;
  Rate offers_, bytes_;
  bool welcomed_ = false;
  struct Offered {
    wire::GroomHash hash{};
    // The offset of the next byte in the groom.
    std::uint64_t offset = 0;
  };
  std::vector<Offered> offered_;
};

}  // namespace hairnet::load
