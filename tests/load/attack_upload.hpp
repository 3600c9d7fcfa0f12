#pragma once

#include <vector>

#include "core/random.hpp"
#include "tests/load/attacker.hpp"

namespace hairnet::load {

// Uploads a groom as fast as it may, and when the server has refused or built it, the same groom under another name.
class AttackUpload final : public Attacker {
 public:
  // `bytes` contain kAttackGroomName, whose digits each upload changes.
  AttackUpload(const AttackContext& context, std::uint32_t host, std::vector<std::uint8_t> bytes, std::uint32_t first);

 private:
  void begin(std::int64_t now_ns) override;
  void proceed(std::int64_t now_ns) override;
  void hear(const wire::Message& message, std::int64_t now_ns) override;
  void offer(std::int64_t now_ns);

  std::vector<std::uint8_t> bytes_;
  std::size_t name_at_, sent_ = 0;  // bytes_.size(): all
  std::uint32_t number_;
  wire::GroomHash hash_{};
  std::int64_t offer_ns_;  // when the next groom is offered
};

// Offers grooms whose bytes come slowly, or never.
struct SlowOffers {
  // Is the size of each groom.
  std::uint64_t byte_count = 0;
  double offers_hz = 0;
  std::uint32_t offers_max = 0;
  // Counts bytes a second of each groom.
  double byte_hz = 0;
  // Offers the late joiner's groom, else grooms that nobody has.
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
    // Is where the next byte lies.
    std::uint64_t offset = 0;
  };
  std::vector<Offered> offered_;
};

}  // namespace hairnet::load
