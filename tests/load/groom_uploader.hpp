#pragma once

#include <boost/asio.hpp>
#include <functional>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "core/result.hpp"
#include "tests/load/client_connection.hpp"
#include "tests/load/protocol_client.hpp"

namespace hairnet::load {

// Uploads grooms, waits until the server has built their levels, and stays connected, so that the server keeps them.
// One uploader does so before the run and is not measured, since a load test does not include the building of levels.
// Each late joiner has another one.
class GroomUploader final : private ConnectionEvents, private ProtocolEvents {
 public:
  GroomUploader(Connector& connector, std::unique_ptr<ProtocolClient> protocol, const std::vector<EncodedGroom>& grooms,
                std::uint32_t host = 0);
  [[nodiscard]] bool welcomed() const { return welcomed_; }
  [[nodiscard]] bool done() const { return welcomed_ && waiting_.empty(); }
  [[nodiscard]] const std::string& error() const { return error_; }  // one line; empty while all is well
  [[nodiscard]] const wire::Welcome& welcome() const { return welcome_; }
  // Call it regularly: sends what waits, and keep-alives.
  void poll(std::int64_t now_ns);

 private:
  void on_open(std::int64_t now_ns) override;
  void on_packet(std::span<const std::uint8_t> packet, std::int64_t arrival_ns) override;
  void on_closed(std::string_view reason, std::int64_t now_ns) override;
  void on_welcome(const wire::Welcome& welcome, std::int64_t now_ns) override;
  void on_lost(std::string_view reason, std::int64_t now_ns) override;
  void on_end(std::string_view reason, std::int64_t now_ns) override;
  void on_groom_state(const wire::GroomHash& groom, wire::GroomState state) override;
  void on_refusal(std::string_view reason, std::int64_t now_ns) override;
  void on_frame(const FrameSeen&, std::int64_t) override {}
  void on_hands(const HandsSeen&, std::int64_t) override {}
  void on_props(const wire::RoomProps&, std::int64_t) override {}
  void on_held(std::uint32_t, std::int64_t) override {}

  std::unique_ptr<ProtocolClient> protocol_;
  const std::vector<EncodedGroom>* grooms_;
  // The grooms that are not ready yet.
  std::set<wire::GroomHash> waiting_;
  bool welcomed_ = false;
  wire::Welcome welcome_;
  // `error_` is what error() returns. The others are the last refusal, and how the last connection ended.
  std::string error_, last_word_, closed_;
  Connector* connector_;
  std::uint32_t host_;
  std::unique_ptr<ClientConnection> connection_;
};

}  // namespace hairnet::load
