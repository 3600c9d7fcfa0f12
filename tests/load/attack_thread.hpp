#pragma once

#include <map>
#include <string>
#include <thread>
#include <vector>

#include "tests/load/attacker.hpp"
#include "tests/load/plan.hpp"
#include "tests/load/protocol_client.hpp"
#include "tests/load/tcp_client_connection.hpp"

namespace hairnet::load {

// Carries out the attacks of a plan, each during its stage. Its thread has the lowest priority, so that the cost of an
// attack delays none of the well-behaved clients, whose latency shows the effect on the server.
class AttackThread {
 public:
  // The thread sets the connector and the events of its copy of `context` itself. `late_joiner_grooms` has the groom
  // that a late joiner will upload in each stage. `plan` must outlive this.
  AttackThread(const Plan& plan, const asio::ip::tcp::endpoint& server, const AttackContext& context,
               std::vector<EncodedGroom> late_joiner_grooms, std::int64_t begin_ns);

  // Ends the attacks, and returns for each stage what attackers did and heard, counted. Once.
  std::vector<std::map<std::string, std::uint64_t, std::less<>>> finish();

 private:
  void run(const std::stop_token& stop);
  void attack(std::size_t stage, const std::stop_token& stop);

  const Plan* plan_;
  asio::ip::tcp::endpoint server_;
  AttackContext context_;
  std::vector<EncodedGroom> late_joiner_grooms_;
  std::int64_t begin_ns_;
  // The counts of AttackContext::events for each stage.
  std::vector<std::map<std::string, std::uint64_t, std::less<>>> events_;
  std::jthread thread_;
};

}  // namespace hairnet::load
