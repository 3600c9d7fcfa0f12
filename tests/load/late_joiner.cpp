#include "tests/load/late_joiner.hpp"

#include <algorithm>
#include <utility>

#include "schema/channel/monotonic_clock.hpp"
#include "tests/load/get_page.hpp"

namespace hairnet::load {
namespace {

// A monitor asks once a second. It waits for an answer for 5 s, which is also what a missing answer counts as.
constexpr std::int64_t kHealthInterval_ns = 1'000'000'000;
constexpr std::chrono::seconds kHealthWait{5};

double seconds_between(std::int64_t from_ns, std::int64_t to_ns) {
  return static_cast<double>(to_ns - from_ns) * 1e-9;
}

}  // namespace

LateJoiner::LateJoiner(asio::io_context& io, Connector& connector, asio::ip::tcp::endpoint server,
                       std::unique_ptr<ProtocolClient> protocol, EncodedGroom groom, std::uint32_t host,
                       std::int64_t at_ns)
    : io_(&io),
      server_(std::move(server)),
      grooms_{std::move(groom)},
      uploader_(connector, std::move(protocol), grooms_, host),
      at_ns_(at_ns),
      health_ns_(at_ns) {}

void LateJoiner::poll(std::int64_t now_ns) {
  if (now_ns < at_ns_) return;
  uploader_.poll(now_ns);
  if (uploader_.welcomed() && welcome_ns_ == 0) welcome_ns_ = now_ns;
  if (uploader_.done() && ready_ns_ == 0) ready_ns_ = now_ns;
  if (now_ns >= health_ns_ && !health_->waits) ask_for_health(now_ns);
}

void LateJoiner::ask_for_health(std::int64_t now_ns) {
  health_ns_ = now_ns + kHealthInterval_ns;
  health_->waits = true;
  get_page(*io_, server_, "/healthz", kHealthWait, [health = health_, now_ns](std::string_view body) {
    health->waits = false;
    const double took_s = seconds_between(now_ns, channel::monotonic_ns());
    health->max_s = std::max(health->max_s, body.empty() ? std::chrono::duration<double>(kHealthWait).count() : took_s);
  });
}

Figures LateJoiner::figures(std::int64_t now_ns) const {
  if (now_ns < at_ns_) return {};
  return {{"late_joiner_welcome_s", seconds_between(at_ns_, welcome_ns_ > 0 ? welcome_ns_ : now_ns)},
          {"late_joiner_ready_s", seconds_between(at_ns_, ready_ns_ > 0 ? ready_ns_ : now_ns)},
          {"healthz_max_s", health_->max_s}};
}

}  // namespace hairnet::load
